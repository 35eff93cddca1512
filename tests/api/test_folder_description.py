"""A recording with an attribute that cannot be read keeps nobody from seeing the others."""

import h5py
import numpy as np
import pytest

from api.service.folder_description import describe_folder
from api.service.session_payload import UndescribedPayload

YAML = """format: 1
name: odd
robot: {gravity: [0.0, -9.81, 0.0], joints: [{name: j1, type: revolute, drive_gain: 10.0}]}
payloads: [{name: none, mass: 0.0}]
sessions: [{file: session-00.h5, payload: none}]
"""


@pytest.fixture
def odd(tmp_path):
    """An experiment whose file has a status, a payload that is none, and an attribute of HDF5's time type, which NumPy has
    not."""
    (tmp_path / "experiment.yaml").write_text(YAML)
    path = tmp_path / "session-00.h5"
    with h5py.File(path, "w", libver="latest") as file:
        file.attrs["status"] = "complete"
        file.attrs["payload"] = "[1, 2]"
        file.attrs["empty"] = h5py.Empty("f")
        file.attrs["void"] = np.void(b"\x00\x01")
        file.attrs["status_reason"] = "x" * 2_000_000
        h5py.h5a.create(file.id, b"odd", h5py.h5t.UNIX_D32LE, h5py.h5s.create(h5py.h5s.SCALAR))
    with h5py.File(path) as file, pytest.raises(TypeError):
        _ = file.attrs["odd"]
    return tmp_path


def test_what_can_be_read_is_and_the_rest_is_passed_over(odd):
    described = describe_folder(odd).recordings["session-00.h5"]
    assert (described.state, described.reason) == ("done", "x" * 100_000)


def test_a_payload_that_is_none_is_unknown(odd):
    assert describe_folder(odd).recordings["session-00.h5"].payload == UndescribedPayload()
