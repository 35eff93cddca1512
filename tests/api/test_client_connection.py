"""The client's connection, against small servers that answer as the service does at its worst."""

import json
import threading
from collections.abc import Generator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import httpx
import numpy as np
import pytest

from api.client import Client, ServiceError
from identify.recording.errors import InputError

ADA = {"name": "ada", "role": "viewer", "via": "token", "csrf_token": None}


@contextmanager
def answering(stopped: bool, headers: dict[str, str]) -> Generator[tuple[int, list[tuple[str, str, str]]]]:
    """A server that answers everything by who asks and `stopped`; its port, and what was asked of it."""
    asked: list[tuple[str, str, str]] = []

    class Answer(BaseHTTPRequestHandler):
        def answer(self) -> None:
            self.rfile.read(int(self.headers.get("Content-Length", "0")))
            asked.append((self.command, self.path, self.headers.get("Authorization", "")))
            body = json.dumps({**ADA, "stopped": stopped}).encode()
            self.send_response(200)
            for name, value in {**headers, "Content-Length": str(len(body))}.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(body)

        do_GET = do_POST = answer  # noqa: N815  the names that http.server asks for

        def log_message(self, format: str, *args: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Answer) as server:
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        try:
            yield server.server_port, asked
        finally:
            server.shutdown()


def client_of(answer: httpx.Response) -> Client:
    return Client(
        "", http=httpx.Client(base_url="http://there", transport=httpx.MockTransport(lambda _: answer))
    )


def test_a_stop_goes_to_the_port_that_the_service_named_with_the_same_token():
    with (
        answering(True, {}) as (stop_port, stops),
        answering(False, {"Stop-Port": str(stop_port)}) as (port, asked),
        Client(f"http://127.0.0.1:{port}", token="secret") as client,
    ):
        client.me()
        assert client.stop("rig") is True
    assert asked == [("GET", "/me", "Bearer secret")]
    assert stops == [("POST", "/rigs/rig/stop", "Bearer secret")]


def test_a_stop_that_its_own_port_does_not_take_goes_the_way_of_all_calls():
    with answering(True, {}) as (gone, _):
        pass
    with (
        answering(True, {"Stop-Port": str(gone)}) as (port, asked),
        Client(f"http://127.0.0.1:{port}") as client,
    ):
        client.me()
        assert client.stop("rig") is True
    assert [path for _, path, _ in asked] == ["/me", "/rigs/rig/stop"]


def test_what_is_no_problem_document_is_an_error_with_its_text():
    with pytest.raises(ServiceError, match=r"^bad gateway$") as refused:
        client_of(httpx.Response(502, text="bad gateway")).me()
    assert refused.value.status == 502


def test_what_a_newer_service_adds_is_left_out_and_what_it_took_away_is_named():
    me = ADA | {"language": "fr"}
    assert client_of(httpx.Response(200, json=me)).me().name == "ada"
    del me["role"]
    with pytest.raises(InputError, match=r"^/me: not a Me of this version: role: Field required$"):
        client_of(httpx.Response(200, json=me)).me()


def test_a_version_of_a_service_before_documents_had_a_form_is_read():
    story = Path(__file__).parents[1] / "identify" / "results" / "stored-format-1"
    identification, diagnosis = (
        json.loads((story / "m1" / "f1" / f"{name}.json").read_text())
        for name in ("identification", "diagnosis")
    )
    assert "format" not in identification
    version = json.loads((story / "story.json").read_text())["versions"][0]
    answer = {"version": version, "identification": identification, "diagnosis": diagnosis}
    read = client_of(httpx.Response(200, json=answer)).model("arm", "m1")
    assert read.version.fit.relative_error == read.identification.relative_error
    assert read.diagnosis is not None
    assert read.diagnosis.joints[0].joint == identification["joints"][0]["joint"]


@pytest.mark.parametrize(
    ("problem", "text"),
    [
        ({"title": "Conflict", "detail": "somebody has it"}, "somebody has it"),
        ({"title": "Conflict"}, "Conflict"),
        ({}, "status 409"),
    ],
)
def test_a_refusal_says_the_most_that_the_service_said(problem, text):
    with pytest.raises(ServiceError) as refused:
        client_of(httpx.Response(409, json=problem)).me()
    assert str(refused.value) == text
    assert refused.value.problem == problem


def test_signals_are_rows_of_float32_after_a_row_of_times_from_the_origin():
    values = np.array([[0.0, 0.5], [1.0, 2.0], [-3.0, 4.0]], "<f4")
    headers = {"X-Columns": "time,position,command", "X-Time-Origin": "1000000.25"}
    answer = httpx.Response(200, content=values.tobytes(), headers=headers)
    time, signals = client_of(answer).recorded_signals("arm", "session-00")
    np.testing.assert_array_equal(time, [1000000.25, 1000000.75])
    np.testing.assert_array_equal(signals["position"], [1.0, 2.0])
    np.testing.assert_array_equal(signals["command"], [-3.0, 4.0])
