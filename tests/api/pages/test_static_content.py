"""Static files: kept by browsers for good, under an address that changes with their content."""

from __future__ import annotations

import asyncio
import gzip
import hashlib

import pytest
from fastapi import Request

from api.pages.static_content import FOLDER, static_address, static_digest, static_file, static_files
from api.service.problems import Problem


def test_every_file_of_the_folder_is_served_as_it_is_and_nothing_else():
    files = static_files()
    assert set(files) == {path.relative_to(FOLDER).as_posix() for path in FOLDER.rglob("*") if path.is_file()}
    assert {name.rpartition(".")[2] for name in files} >= {"css", "js"}
    for name, file in files.items():
        assert file.content == (FOLDER / name).read_bytes()
        assert (file.compressed is not None) == name.endswith((".css", ".js", ".svg"))
        if file.compressed is not None:
            assert gzip.decompress(file.compressed) == file.content
    assert {file.kind for name, file in files.items() if name.endswith(".css")} == {"text/css"}


def test_the_address_holds_a_digest_of_all_names_and_contents():
    every = hashlib.sha256()
    for name in sorted(static_files(), key=lambda each: FOLDER / each):
        every.update(name.encode() + (FOLDER / name).read_bytes())
    assert static_digest() == every.hexdigest()[:12]
    assert static_address("a.css") == f"/pages/static/{static_digest()}/a.css"


def answer(name, accepted):
    headers = [(b"accept-encoding", accepted.encode())]
    request = Request({"type": "http", "method": "GET", "path": static_address(name), "headers": headers})
    return asyncio.run(static_file(request, static_digest(), name))


def test_a_browser_keeps_a_file_for_a_year_and_gets_it_compressed_where_it_asks_for_that():
    name, file = next((name, file) for name, file in static_files().items() if name.endswith(".css"))
    for accepted, encoding, body in (("gzip, br", "gzip", file.compressed), ("identity", None, file.content)):
        given = answer(name, accepted)
        assert given.status_code == 200
        assert given.headers["Cache-Control"] == "public, max-age=31536000, immutable"
        assert given.headers["Vary"] == "Accept-Encoding"
        assert given.headers.get("Content-Encoding") == encoding
        assert given.headers["Content-Type"].startswith("text/css")
        assert given.body == body
    with pytest.raises(Problem, match=r"There is no file none\.css\.") as refused:
        answer("none.css", "gzip")
    assert refused.value.status == 404
