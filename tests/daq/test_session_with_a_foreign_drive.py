"""A whole session, in real time and on a bus between processes, with a drive whose CANopen stack is not ours (durand)."""

import json

import can
import h5py
import numpy as np
import pytest

from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.trapezoid import Move
from daq.rig import Rig
from daq.session_events import SessionState
from daq.session_workflow import PayloadSession
from tests.drivers.foreign_stacks.durand_drive import DurandDrive

NODE = 11
CYCLE = 0.1
RIG = """
name: foreign-drive
cycle: 0.1
bus: {interface: udp_multicast, channel: 239.74.163.2, options: {port: 43190, hop_limit: 0}}
robot:
  gravity: [0.0, -9.81, 0.0]
  joints: [{name: j1, type: revolute}]
axes:
  - joint: j1
    node: 11
    encoder_counts: 4096
    gear_ratio: 10.0
    torque_constant: 0.5
    rated_torque: 2.5
    limits: {position: [-2, 2], velocity: 2, acceleration: 6, jerk: 100, current: 15, following_error: 1.0}
supervision: {silence: 2.0, heartbeat_timeout: 3.0, heartbeat_period: 0.2, parent_timeout: 10.0}
payloads: [{name: none, mass: 0.0}]
"""
PLAN = ExcitationPlan(
    joints=("j1",),
    start=(0.2,),
    phases=(Move(to=(0.6,), duration=3.0, ramp=1.0), Move(to=(0.2,), duration=3.0, ramp=1.0)),
)


@pytest.fixture
def rig(tmp_path):
    (tmp_path / "rig.yaml").write_text(RIG)
    return Rig.load(tmp_path / "rig.yaml")


@pytest.fixture
def foreign(rig):
    drive = DurandDrive(can.Bus(interface="udp_multicast", channel=rig.bus.channel, **rig.bus.options), NODE)
    yield drive
    drive.close()


def cycle_of(foreign) -> float:
    """s, the interpolation time that the drive holds."""
    return foreign.objects.read(0x60C2, 1) * 10.0 ** foreign.objects.read(0x60C2, 2)


def test_a_session_is_recorded_and_the_foreign_drive_ends_without_power(rig, foreign, tmp_path):
    before = cycle_of(foreign)
    assert before != pytest.approx(CYCLE)
    with PayloadSession(rig, tmp_path / "e", PLAN, rig.payload("none"), "operator") as session:
        assert session.check().ok, session.reason
        assert cycle_of(foreign) == pytest.approx(CYCLE)
        session.confirm_payload(0.0)
        session.arm()
        session.start()
        assert session.wait(60) is SessionState.DONE, session.reason
    with h5py.File(session.file) as file:
        valid, counts = file["valid"][:, 0], file["position"][:, 0]
        matrix, offset = file["position"].attrs["matrix"][0, 0], file["position"].attrs["offset"][0]
        counters = json.loads(file.attrs["counters"])
    complete = (valid & 3) == 3
    assert np.mean(complete) > 0.9
    positions = matrix * counts[complete] + offset
    assert (positions.min(), positions.max()) == pytest.approx((0.2, 0.6), abs=2e-3)
    assert counters["frames_dropped"] == 0
    assert foreign.objects.read(0x6041, 0) & 0x6F in (0x40, 0x50 & 0x6F)
    assert cycle_of(foreign) == pytest.approx(before), "what the session has set is put back"
