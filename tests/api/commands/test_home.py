"""`coulomb home` on the simulated drive: what is asked, done and said."""

import json

import pytest
import yaml

from drivers.cia402 import Command
from drivers.simulated import process_image as slot


@pytest.fixture
def file(rig_file):
    """A rig whose drive must be homed."""
    return rig_file(homing="drive")


@pytest.fixture
def drive(file, powered):
    """Its drive, somewhere."""
    drive = powered(file).nodes[0].drive
    drive.image[slot.POSITION] = 12345
    return drive


def test_without_a_yes_nothing_is_homed(coulomb_here, file, drive):
    zero = drive.position_offset
    answer = coulomb_here("home", str(file), "--json", given="n\n")
    assert (answer.returncode, answer.stdout.strip()) == (1, "")
    assert "Joint j3 will move to find its home. Start? [y/N]" in answer.stderr
    assert drive.position_offset == zero
    for method in ("35", "37"):
        answer = coulomb_here("home", str(file), "--method", method, given="n\n")
        assert "Joint j3 will take its present position as its home. Start?" in answer.stderr
        assert drive.position_offset == zero
    assert (
        "will move to find its home" in coulomb_here("home", str(file), "--method", "36", given="n\n").stderr
    )


def test_a_joint_is_homed_after_its_faults_were_reset_and_both_are_said(coulomb_here, file, drive, rig):
    drive.fail(0x4310)
    answer = coulomb_here("home", str(file), "j3", "--method", "37", "--reset-faults", "--json", given="y\n")
    assert answer.returncode == 0, answer.stderr
    document = json.loads(answer.stdout)
    assert document["rig"] == rig.name
    (reset,) = document["faults_reset"]
    assert reset.startswith("joint j3 (node 3): fault reset; it was 0x4310")
    assert reset in " ".join(answer.stderr.split())
    (joint,) = document["joints"]
    assert joint["joint"] == "j3"
    assert joint["position"] == pytest.approx(0.0, abs=1e-3), "here is home"
    assert joint["within_limits"] is True
    assert f"joint j3: {joint['words']}" in " ".join(answer.stderr.split())


def test_a_drive_that_has_power_is_named_and_left_alone(coulomb_here, rig_file, powered):
    file = rig_file(homing="drive", sync_timeout=60.0)
    drive = powered(file).nodes[0].drive
    for command in (Command.SHUTDOWN, Command.SWITCH_ON, Command.ENABLE_OPERATION):
        drive.image[slot.CONTROLWORD] = command.value
        drive.take_controlword()
    state = drive.machine.state
    answer = coulomb_here("home", str(file), "--method", "37", "--yes", "--json")
    assert (answer.returncode, answer.stdout.strip()) == (1, "")
    assert "it has power already; nothing was written to it" in " ".join(answer.stderr.split())
    assert drive.machine.state is state


def test_a_real_robot_is_not_started_without_asking(coulomb_here, file):
    settings = yaml.safe_load(file.read_text(encoding="utf-8"))
    del settings["simulated"]
    settings["pacing"] = "real-time"
    file.write_text(yaml.safe_dump(settings), encoding="utf-8")
    answer = coulomb_here("home", str(file), "--yes")
    assert answer.returncode == 2
    assert answer.stderr.startswith("coulomb: --yes: is for simulated rigs")


def test_an_axis_whose_encoder_knows_its_zero_is_not_homed(coulomb_here, rig_file):
    answer = coulomb_here("home", str(rig_file()), "j3", "--yes")
    assert answer.returncode == 2
    assert "j3: has an absolute encoder" in answer.stderr
