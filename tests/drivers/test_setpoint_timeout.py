"""The drive's own watch over its torque setpoints: told to it, read back, and what the (simulated) drive then does by itself."""

from __future__ import annotations

import struct
import time

import numpy as np
import pytest

from drivers.cia402 import Command, Mode, State
from drivers.errors import DriveError
from drivers.process_data import TARGET_TORQUE
from drivers.simulated.oddities import OdditySettings

CSP = Mode.CYCLIC_SYNCHRONOUS_POSITION
PERIOD = 0.001


def streaming(bench, reaction: int | None = None, timeout: float = 0.0041):
    """In torque mode with power, and the stream of its setpoints."""
    drive = bench.drive
    stream = drive.map_stream(CSP, torque=TARGET_TORQUE)
    said = drive.watch_setpoints(stream, timeout)
    if reaction is not None:
        drive.sdo.write(0x6007, 0, "int16", reaction)
    drive.set_mode(Mode.CYCLIC_SYNCHRONOUS_TORQUE)
    drive.set_cycle(PERIOD)
    drive.produce_heartbeat(0.05)
    drive.set_nmt_state("OPERATIONAL")
    bench.setpoints = lambda word, torque: bench.receiver.send(
        stream.receive.can_id, stream.packed_with_torque(word, 0, torque)
    )
    for word in (Command.SHUTDOWN, Command.SWITCH_ON, Command.ENABLE_OPERATION):
        bench.setpoints(word, 0)
        bench.run(1)
    bench.setpoints(Command.ENABLE_OPERATION, 0)
    bench.run(1)
    assert drive.state() is State.OPERATION_ENABLED
    return said


def test_the_timer_is_rounded_up_to_milliseconds_and_a_quick_stop_is_asked_for(open_bench):
    bench = open_bench()
    stream = bench.drive.map_stream(CSP, torque=TARGET_TORQUE)
    words = bench.drive.watch_setpoints(stream, 0.0041)
    assert words == "stops by itself after 5 ms without a torque setpoint (0x1400:05), with a quick stop"
    assert bench.drive.sdo.read(0x1400, 5, "uint16", "looking") == 5
    assert bench.drive.sdo.read(0x6007, 0, "int16", "looking") == 3


def test_the_watch_that_a_drive_had_before_is_given_back_to_it(open_bench):
    bench = open_bench()
    drive = bench.drive
    stream = drive.map_stream(CSP, torque=TARGET_TORQUE)
    drive.sdo.write(0x1400, 5, "uint16", 70)
    drive.sdo.write(0x6007, 0, "int16", 2)
    drive.watch_setpoints(stream, 0.0041)
    drive.end_setpoint_watch()
    assert drive.sdo.read(0x1400, 5, "uint16", "looking") == 70
    assert drive.sdo.read(0x6007, 0, "int16", "looking") == 2
    drive.sdo.write(0x1400, 5, "uint16", 80)
    drive.end_setpoint_watch()
    assert drive.sdo.read(0x1400, 5, "uint16", "looking") == 80


@pytest.mark.parametrize(
    ("oddities", "words"),
    [
        (
            {"missing": ("0x1400:05",)},
            r"0x1400:05.*stop by themselves when no setpoint comes; this one cannot",
        ),
        ({"read_only": ("0x1400:05",)}, r"0x1400:05.*cannot be told to"),
        ({"missing": ("0x6007",)}, r"0x6007.*cannot be told to"),
        (
            {"read_only": ("0x6007",), "holds": {"0x6007": 0}},
            r"0x6007.*0 came: it would go on with the last torque",
        ),
    ],
)
def test_a_drive_that_would_not_stop_by_itself_is_refused_and_named(open_bench, axis, oddities, words):
    bench = open_bench(axis(oddities=OdditySettings(**oddities)))
    stream = bench.drive.map_stream(CSP, torque=TARGET_TORQUE)
    with pytest.raises(DriveError, match=words):
        bench.drive.watch_setpoints(stream, 0.01)


def test_a_drive_whose_reaction_is_a_fault_and_can_only_be_read_will_do(open_bench, axis):
    bench = open_bench(axis(oddities=OdditySettings(read_only=("0x6007",))))
    stream = bench.drive.map_stream(CSP, torque=TARGET_TORQUE)
    assert bench.drive.watch_setpoints(stream, 0.01).endswith("with a fault")


@pytest.mark.parametrize(
    ("reaction", "state"),
    [
        (3, State.SWITCH_ON_DISABLED),
        (2, State.SWITCH_ON_DISABLED),
        (1, State.FAULT),
        (0, State.OPERATION_ENABLED),
    ],
)
def test_an_axis_whose_setpoints_stay_away_stops_by_itself_as_0x6007_says(open_bench, reaction, state):
    """A torque of 20 % for 30 ms, and then silence of the setpoints while SYNC goes on."""
    bench = open_bench()
    streaming(bench, reaction)
    for _ in range(30):
        bench.setpoints(Command.ENABLE_OPERATION, 200)
        bench.run(1)
    assert bench.drive.state() is State.OPERATION_ENABLED
    bench.run(4)
    assert bench.drive.state() is State.OPERATION_ENABLED
    bench.receiver.read()
    speed = abs(float(bench.flywheels.motor_velocity[0]))
    assert speed > 1.0
    frames = bench.run(400)
    assert bench.drive.state() is state
    emergencies = [
        struct.unpack("<H", bytes(frame["data"][:2]))[0] for frame in frames if frame["can_id"] == 0x85
    ]
    assert 0x8250 in emergencies
    after = abs(float(bench.flywheels.motor_velocity[0]))
    assert (after > 1.5 * speed) if reaction == 0 else (after < 0.1)
    angle = np.array(bench.flywheels.motor_angle)
    bench.run(20)
    assert reaction == 0 or np.abs(bench.flywheels.motor_angle - angle).max() < 0.01


def test_an_axis_stops_by_itself_when_sync_stays_away_with_the_setpoints(open_bench):
    """As when the process that sends both is killed: no other watch of the drive acts, it stops in its own time."""
    bench = open_bench(run_on_after=0.02, sync_timeout=600.0)
    streaming(bench)
    for _ in range(30):
        bench.setpoints(Command.ENABLE_OPERATION, 200)
        bench.run(1)
    latest = time.monotonic() + 60.0
    while bench.drive.state() is not State.SWITCH_ON_DISABLED and time.monotonic() < latest:
        pass
    assert bench.drive.state() is State.SWITCH_ON_DISABLED
    assert [each.code for each in bench.drive.emergencies] == [0x8250]
    assert abs(float(bench.flywheels.motor_velocity[0])) < 0.1
