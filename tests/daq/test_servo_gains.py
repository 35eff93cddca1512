"""Gains read from drives are those with which they were set up, in the units of the record."""

import h5py
import numpy as np
import pytest

from daq.recording_file import RecordingFile, SessionDescription
from daq.rig import Rig
from daq.rig_drives import RigDrives
from daq.servo_gains import GainsRead, gains_of, read_servo_gains
from daq.simulated_rig import simulated_rig
from identify.recording.controller_file import ControllerFile, JointController
from identify.recording.errors import InputError
from identify.recording.session_hdf5 import read_hdf5_controller


def read(rig):
    with simulated_rig(rig, rig.payload("none")):
        drives = RigDrives(rig)
        try:
            return read_servo_gains(drives)
        finally:
            drives.close()


def with_drive(rig, **settings):
    drive = {**rig.simulated["drives"][0], **settings}
    return rig.model_copy(update={"simulated": {**rig.simulated, "drives": [drive]}})


def test_six_coupled_drives_tell_the_gains_that_their_settings_have():
    """Expected from the rig's file by hand: v = N (K_v w + K_i ∫w dt), w = K_p e + q̇_ref − q̇, N of the motor's own joint."""
    rig = Rig.load("tx40-simulated")
    held = gains_of(rig)
    assert held.coordinates == "motors"
    gears = np.array([row[place] for place, row in enumerate(rig.gear_matrix)])
    for joint, gear, drive in zip(held.joints, gears, rig.simulated["drives"], strict=True):
        servo = drive["servo"]
        stiffness, damping, integral = (
            servo[name] for name in ("position_gain", "velocity_gain", "velocity_integral")
        )
        assert joint.position == pytest.approx(gear * (stiffness * damping + integral), rel=1e-9)
        assert joint.integral == pytest.approx(gear * stiffness * integral, rel=1e-9)
        assert joint.velocity == joint.reference_velocity == pytest.approx(gear * damping, rel=1e-9)
        assert joint.reference_travel == 0.0
    assert "joint j6 (node 6): velocity_gain 0x2031:00 = 31000, 0.031 A s/rad" in held.read_from
    assert "joint j1: the low-pass of 1 ms on the measured speed" in held.left_out


def test_what_is_written_into_the_drive_is_what_it_says_and_does(still_rig, powered):
    drives = RigDrives(still_rig)
    try:
        before = read_servo_gains(drives).controllers.joints[0]
        servo = powered.nodes[0].drive.servo
        current = servo.follow_velocity(1e4, 1e9, 1e-9)
        servo.reset()
        drives.drives[0].sdo.write(0x2031, 0, "uint32", 900_000)
        assert servo.follow_velocity(1e4, 1e9, 1e-9) == pytest.approx(0.5 * current, rel=1e-6)
        assert read_servo_gains(drives).controllers.joints[0].velocity == pytest.approx(0.5 * before.velocity)
    finally:
        drives.close()


def test_a_friction_table_in_the_drive_is_said_to_be_beside_the_law(still_rig):
    table = {"speeds": [100.0], "forward": [0.5], "backward": [-0.5]}
    said = read(with_drive(still_rig, compensation=table)).controllers.left_out
    assert "joint j3: the current that the drive adds by its own friction table" in said


def test_a_drive_that_does_not_tell_is_a_remark_and_no_obstacle(still_rig):
    found = read(with_drive(still_rig, oddities={"missing": ["0x2031"]}))
    assert found.controllers is None
    assert "joint j3: the gains are not kept: node 3: reading the gains" in found.remarks[0]


def test_a_profile_without_gains_reads_nothing_and_is_named_where_they_are_asked_for(still_rig):
    generic = still_rig.axes[0].model_copy(update={"drive": "generic-cia402"})
    rig = still_rig.model_copy(update={"axes": (generic,)})
    assert read(rig) == GainsRead(None)
    with pytest.raises(InputError, match="the profile generic-cia402 does not say where its drives keep"):
        gains_of(rig)


def test_a_recording_keeps_the_gains_and_gives_them_back(still_rig, tmp_path):
    law = JointController(joint="j3", position=10830.0, velocity=171.0, integral=171000.0)
    held = ControllerFile(joints=(law,), read_from=("0x2030:00 = 30000",))
    payload = still_rig.payload("none")
    for name, controllers in (("with", held), ("without", None)):
        path = tmp_path / f"{name}.h5"
        description = SessionDescription(still_rig, {}, payload, "ada", "none", controllers=controllers)
        RecordingFile(path, description).finish("complete", "", {}, "plan_done")
        assert read_hdf5_controller(path) == controllers
    with h5py.File(path, "a") as file:
        file.attrs["controller"] = '{"joints": []}'
    with pytest.raises(InputError, match="attribute 'controller': joints"):
        read_hdf5_controller(path)
