"""A proof in its folder: what it is compared by, and the rig that its torque was computed for."""

import errno
from dataclasses import replace

import numpy as np
import pytest

import api.proof
from api.proof import Proof, TorqueAhead, prepared_rig, read_settings
from daq.files_as_read import drive_digests
from daq.rig import Rig
from daq.torque_offset import TorqueOffset
from identify.recording import InputError
from tests.api.driven_arm import short_plan
from tests.api.proof_settings import proof_settings


@pytest.fixture
def proof(tmp_path):
    rig = Rig.load("rx130l-joint3-simulated")
    nothing = np.zeros((4, 1))
    offset = TorqueOffset(np.ones((4, 1), np.int16), np.ones(1), np.zeros(1))
    ahead = TorqueAhead(offset, nothing, nothing, nothing, nothing, ())
    kept = Proof(
        tmp_path / "00", proof_settings(rig, "arm", rig.payload("none")), rig, short_plan("short"), ahead
    )
    kept.store()
    return kept


def test_a_proof_that_another_process_stores_meanwhile_keeps_its_folder(proof):
    """Both asked for the next number before either had taken it."""
    before = {file: file.read_bytes() for file in proof.folder.iterdir()}
    other = replace(proof, settings=proof.settings.model_copy(update={"operator": "grace"})).store()
    assert other.folder == proof.folder.with_name("01")
    assert read_settings(other.folder).operator == "grace"
    assert {file: file.read_bytes() for file in proof.folder.iterdir()} == before
    # a number without its files, as a killed process leaves it, is nobody's to be filled
    proof.folder.with_name("02").mkdir()
    assert replace(proof, folder=other.folder).store().name == "03"


def test_nothing_is_left_of_a_proof_that_a_full_disk_does_not_take(proof, monkeypatch):
    real = api.proof.write_atomically

    def full(file, content):
        if file.name == api.proof.AHEAD:
            raise OSError(errno.ENOSPC, "No space left on device")
        real(file, content)

    monkeypatch.setattr(api.proof, "write_atomically", full)
    with pytest.raises(
        InputError, match=r"01: the proof cannot be written: No space left on device; nothing moved$"
    ):
        proof.store()
    assert [each.name for each in proof.folder.parent.iterdir()] == ["00"]


def test_a_rig_whose_file_was_changed_since_drives_neither_run(proof):
    proof.require_prepared_for(proof.rig)
    assert prepared_rig(proof.folder) == proof.rig
    other = proof.rig.model_copy(update={"cycle": 0.004})
    with pytest.raises(
        InputError, match=r"rig .*: cycle changed since the proof was prepared; prepare another proof"
    ):
        proof.require_prepared_for(other)


def test_a_proof_of_an_earlier_version_says_nothing_of_its_rig_and_a_damaged_one_is_named(proof):
    file = proof.folder / "rig.json"
    file.write_text('{"name": 3}')
    with pytest.raises(InputError, match=r"rig\.json: cannot be read; prepare another proof"):
        prepared_rig(proof.folder)
    file.unlink()
    proof.require_prepared_for(proof.rig.model_copy(update={"cycle": 0.004}))


def test_a_drive_whose_profile_was_changed_since_drives_neither_run(proof):
    digests = drive_digests(proof.rig)
    kept = replace(proof, settings=proof.settings.model_copy(update={"drives": digests}))
    kept.require_prepared_for(proof.rig)
    other = kept.settings.model_copy(update={"drives": ("another",) * len(digests)})
    with pytest.raises(
        InputError,
        match=r"drive of j3: .*\.yaml or .*\.eds changed since the proof was prepared; prepare another",
    ):
        replace(proof, settings=other).require_prepared_for(proof.rig)
