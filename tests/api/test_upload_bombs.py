"""Uploads made to hold the service up: each ends in one line, and everybody else is answered meanwhile."""

import io
import threading
import time
import zipfile
import zlib
from itertools import pairwise

import h5py
import httpx
import numpy as np
import pytest

from api.service.accounts import Role
from api.service.confined_reader import ConfinedReader
from api.service.process_limits import GIBIBYTE, MEBIBYTE, ProcessLimits

YAML = """format: 1
name: uploaded
robot: {gravity: [0.0, -9.81, 0.0], joints: [{name: j1, type: revolute, drive_gain: 10.0}]}
payloads: [{name: none, mass: 0.0}]
sessions: [SESSIONS]
"""
LONGEST_ANSWER = 1.0
"""s; an answer takes milliseconds, and two seconds without a sign of life stop a motion."""
PATIENCE = 100.0
"""s that an upload may take where another limit is what is tested; seconds, unless the machine is busy"""


def archive(members):
    """A zip archive of these members; an experiment.yaml that lists the sessions among them unless there is one."""
    packed = io.BytesIO()
    sessions = ", ".join(f"{{file: {name}, payload: none}}" for name in members if name != "experiment.yaml")
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as out:
        for name, content in ({"experiment.yaml": YAML.replace("SESSIONS", sessions)} | members).items():
            out.writestr(name, content)
    return packed.getvalue()


def aliases():
    """A few lines of YAML that mean billions of values."""
    lines = ["a: &a [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"{name}: &{name} [{', '.join([f'*{before}'] * 10)}]" for before, name in pairwise("abcdefghi")]
    return "\n".join(lines)


def recording(path, rows, chunk=None, attribute=0):
    """A recording that declares its rows and stores none of them."""
    with h5py.File(path, "w", libver="latest") as file:
        file.attrs.update(
            {"format": 1, "cycle": 1e-3, "status": "complete", "status_reason": "", "rig": "{}"}
        )
        for name, kind, shape in (
            ("cycle", np.int64, (rows,)),
            ("sync_time", np.int64, (rows,)),
            ("position", np.int32, (rows, 1)),
            ("command", np.int32, (rows, 1)),
            ("setpoint", np.int32, (rows, 1)),
            ("valid", np.uint8, (rows, 1)),
        ):
            chunks = None if chunk is None else (chunk, *shape[1:])
            most = None if chunk is None else (None, *shape[1:])
            file.create_dataset(name, shape, kind, chunks=chunks, maxshape=most, fillvalue=3)
        file["position"].attrs.update({"matrix": np.eye(1), "offset": np.zeros(1)})
        file["command"].attrs["scale"] = np.ones(1)
        if attribute:
            file.attrs["operator"] = np.zeros(attribute, np.uint8)
    return path.read_bytes()


def one_chunk(path):
    """Some 80 kB on disk that unpack to a chunk of 80 MB, which HDF5 needs whole for any sample in it."""
    rows, packing = 10_000_000, zlib.compressobj(1)
    packed = b"".join(packing.compress(bytes(1 << 20)) for _ in range(rows * 8 // (1 << 20)))
    packed += packing.compress(bytes(rows * 8 % (1 << 20))) + packing.flush()
    recording(path, rows, chunk=rows)
    with h5py.File(path, "a") as file:
        for name in ("cycle", "sync_time"):
            del file[name]
            file.create_dataset(name, (rows,), np.int64, chunks=(rows,), compression="gzip")
            file[name].id.write_direct_chunk((0,), packed)
    return path.read_bytes()


def many_files(path):
    """Each declares less than is accepted; together they declare more."""
    each = recording(path, 30_000_000)
    return {f"a{number}.h5": each for number in range(6)}


BOMBS = {
    "declares more than is accepted": (lambda path: {"a.h5": recording(path, 300_000_000)}, 413),
    "many files that each declare less": (many_files, 413),
    "declares 660 MB and stores nothing": (lambda path: {"a.h5": recording(path, 28_000_000)}, 422),
    "one chunk of 80 MB": (lambda path: {"a.h5": one_chunk(path)}, 422),
    "chunk larger than its data": (lambda path: {"a.h5": recording(path, 1000, chunk=400_000_000)}, 413),
    "large attribute": (lambda path: {"a.h5": recording(path, 500, attribute=10_000_000)}, 413),
    "archive in an archive": (lambda path: {"a.csv": archive({"b.csv": "t,q1,v1\n"})}, 422),
    "many members": (lambda path: {f"a{number}.csv": "" for number in range(5001)}, 413),
    "settings that mean billions of values": (lambda path: {"experiment.yaml": aliases()}, 422),
}


@pytest.fixture
def answering(listening):
    """The service, its upload address, and the longest that somebody else waited for an answer since."""
    service = listening.service
    service.uploads._reader = ConfinedReader(ProcessLimits(4 * GIBIBYTE, PATIENCE, 256, 2 * GIBIBYTE))
    token = listening.client(Role.OPERATOR).headers["Authorization"]
    headers = {"Authorization": token}
    asked, ended, waits = threading.Event(), threading.Event(), []

    def ask():
        with httpx.Client(base_url=listening.address, headers=headers) as asking:
            while not ended.is_set():
                began = time.monotonic()
                assert asking.get("/me").status_code == 200
                waits.append(time.monotonic() - began)
                asked.set()

    def upload(content):
        asking = threading.Thread(target=ask)
        asking.start()
        try:
            assert asked.wait(60.0)  # an upload may be refused before anybody else has asked
            with httpx.Client(
                base_url=listening.address, headers=headers, timeout=PATIENCE + 20.0
            ) as sending:
                return sending.post("/experiments/import", files={"file": ("a.zip", content)})
        finally:
            ended.set()
            asking.join()

    return upload, waits, service.settings.data_folder


@pytest.mark.parametrize("name", list(BOMBS))
def test_an_upload_that_would_hold_the_service_up_ends_in_one_line_and_nobody_waits(
    answering, tmp_path, name
):
    upload, waits, data_folder = answering
    make, status = BOMBS[name]
    answer = upload(archive(make(tmp_path / "made.h5")))
    assert answer.status_code == status, answer.text
    assert "\n" not in answer.json()["detail"]
    assert str(data_folder) not in answer.text
    assert list((data_folder / "experiments").iterdir()) == []
    assert max(waits) < LONGEST_ANSWER


@pytest.mark.parametrize("words", ["not done within", "of memory"])
def test_an_upload_that_takes_all_time_or_memory_is_refused_in_words(listening, tmp_path, words):
    limits = ProcessLimits(2 * GIBIBYTE, 0.3) if "done" in words else ProcessLimits(16 * MEBIBYTE, PATIENCE)
    listening.service.uploads._reader = ConfinedReader(limits)
    token = listening.client(Role.OPERATOR).headers["Authorization"]
    content = archive({"a.h5": one_chunk(tmp_path / "made.h5")})
    answer = httpx.post(
        f"{listening.address}/experiments/import",
        files={"file": ("a.zip", content)},
        headers={"Authorization": token},
        timeout=PATIENCE + 20.0,
    )
    assert answer.status_code == 413, answer.text
    assert words in answer.json()["detail"]
