"""`coulomb reset` on the simulated drive: what is asked, done and said."""

import json

import pytest

from daq.drive_reset import ResetJoint
from drivers.cia402 import State


@pytest.fixture
def drive(rig_file, powered):
    return powered(rig_file()).nodes[0].drive


@pytest.fixture
def file(rig_file):
    return str(rig_file())


def test_without_a_yes_the_fault_stays(coulomb_here, file, drive, rig):
    drive.fail(0x4310)
    answer = coulomb_here("reset", file, "--json", given="n\n")
    assert (answer.returncode, answer.stdout.strip()) == (1, "")
    assert f"Rig {rig.name}: drives that have power lose it, faults are reset." in answer.stderr
    assert drive.machine.state is State.FAULT


@pytest.mark.parametrize(("arguments", "given"), [((), "y\n"), (("--yes",), "")])
def test_a_fault_is_reset_and_said(coulomb_here, file, drive, rig, arguments, given):
    drive.fail(0x4310)
    answer = coulomb_here("reset", file, "--json", *arguments, given=given)
    assert answer.returncode == 0, answer.stderr
    document = json.loads(answer.stdout)
    assert document["rig"] == rig.name
    (joint,) = document["joints"]
    assert (joint["joint"], joint["node"], joint["ok"]) == ("j3", 3, True)
    assert joint["words"].startswith("fault reset; it was 0x4310")
    assert f"joint j3 (node 3): {joint['words']}" in " ".join(answer.stderr.split())
    assert drive.machine.state is State.SWITCH_ON_DISABLED


def test_a_joint_that_is_not_reset_is_status_1_with_the_answer_all_the_same(coulomb_here, file, monkeypatch):
    joints = [ResetJoint("j3", 3, True, "nothing to reset"), ResetJoint("j4", 4, False, "the fault stays")]
    monkeypatch.setattr("daq.drive_reset.reset_drives", lambda rig: joints)
    answer = coulomb_here("reset", file, "--json", "--yes")
    assert answer.returncode == 1
    assert [joint["ok"] for joint in json.loads(answer.stdout)["joints"]] == [True, False]
    assert answer.stderr.splitlines() == [
        "joint j3 (node 3): nothing to reset",
        "joint j4 (node 4): the fault stays",
    ]
