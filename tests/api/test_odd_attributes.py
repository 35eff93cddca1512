"""A recording with an attribute that cannot be read keeps nobody from seeing the others."""

import h5py
import numpy as np
import pytest

from api.service.experiment_store import _attributes, _recorded_payload, _recording_state


@pytest.fixture
def odd(tmp_path):
    """A file with a status, a payload that is none, and an attribute of HDF5's time type, which NumPy has not."""
    path = tmp_path / "session-00.h5"
    with h5py.File(path, "w", libver="latest") as file:
        file.attrs["status"] = "complete"
        file.attrs["payload"] = "[1, 2]"
        file.attrs["empty"] = h5py.Empty("f")
        file.attrs["void"] = np.void(b"\x00\x01")
        h5py.h5a.create(file.id, b"odd", h5py.h5t.UNIX_D32LE, h5py.h5s.create(h5py.h5s.SCALAR))
    with h5py.File(path) as file, pytest.raises(TypeError):
        _ = file.attrs["odd"]
    return path


def test_what_can_be_read_is_and_the_rest_is_passed_over(odd):
    assert _attributes(odd)["status"] == "complete"
    assert "odd" not in _attributes(odd)
    assert _recording_state(odd) == ("done", None)


def test_a_payload_that_is_none_is_unknown(odd):
    assert _recorded_payload(odd)[0]["name"] == "unknown"
