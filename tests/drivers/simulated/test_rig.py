"""The simulated drive moves a flywheel: compared with closed forms, mode by mode."""

import math
import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from drivers.bus import BusSettings
from drivers.cia402 import (
    ENABLE_INTERPOLATION,
    HALT,
    INTERNAL_LIMIT_ACTIVE,
    TARGET_REACHED,
    Command,
    Mode,
    State,
    state_of,
)
from drivers.errors import DriveError
from drivers.simulated.rig import SimulatedRig
from drivers.simulated.settings import ServoSettings
from drivers.sync_producer import SimulatedClock

INERTIA, TORQUE_CONSTANT, PERIOD = 1e-3, 0.2, 1e-3
COUNTS = 65536


def swing(amplitude: float, frequency: float):
    """Setpoints (counts) of a swing that starts at rest at zero: amplitude · (1 − cos) turns."""
    return lambda k: round(COUNTS * amplitude * (1 - math.cos(2 * math.pi * frequency * (k + 1) * PERIOD)))


@pytest.mark.parametrize("mode", [Mode.CYCLIC_SYNCHRONOUS_POSITION, Mode.INTERPOLATED_POSITION])
def test_position_modes_follow_the_setpoints(open_bench, mode):
    bench = open_bench()
    bench.bring_up(mode)
    target = swing(0.5, 1.0)
    controlword = 0x1F if mode is Mode.INTERPOLATED_POSITION else 0x0F
    frames = bench.run(2000, target, controlword)
    position = bench.values(frames, "position")
    # Setpoint k is sent after SYNC k, effective at SYNC k+1 and reached at SYNC k+2.
    wanted = np.array([target(k) for k in range(-2, 1998)])
    assert np.max(np.abs(position[1000:] - wanted[1000:])) < 0.01 * COUNTS
    assert {state_of(int(word)) for word in bench.values(frames, "statusword")} == {State.OPERATION_ENABLED}


def test_the_recorded_command_is_the_torque_that_moves_the_flywheel(open_bench):
    """J·a = K_t·i at every SYNC, with a from second differences of the true angle: no delay between them."""
    bench = open_bench()
    bench.bring_up()
    true_angle = []
    sample = bench.node.drive.sample
    bench.node.drive.sample = lambda angle, heat: (sample(angle, heat), true_angle.append(angle))[0]
    frames = bench.run(1500, swing(0.5, 1.0))
    command = bench.values(frames, "command") * 1e-3 * 5.0  # A, rated current 5 A
    angle = np.array(true_angle)
    acceleration = (angle[2:] - 2 * angle[1:-1] + angle[:-2]) / PERIOD**2
    error = INERTIA * acceleration - TORQUE_CONSTANT * command[1:-1]
    moving = slice(200, None)
    scale = np.std(TORQUE_CONSTANT * command[1:-1][moving])
    # Half a cycle of delay would show as a component of the error along the command's derivative.
    slope = np.gradient(TORQUE_CONSTANT * command[1:-1], PERIOD)[moving]
    delay = np.dot(slope, error[moving]) / np.dot(slope, slope)
    assert abs(delay) < 0.1 * PERIOD
    assert np.std(error[moving]) < 0.5 * scale


def test_torque_mode_accelerates_as_newton_says(open_bench):
    bench = open_bench()
    bench.bring_up(Mode.CYCLIC_SYNCHRONOUS_TORQUE)
    frames = bench.run(302, lambda k: 100)  # 10 % of 5 A
    assert set(bench.values(frames, "command")[3:]) == {100}
    # The first setpoint acts from half a servo period after SYNC 1.
    time = 301 * PERIOD - 0.5 * PERIOD
    expected = TORQUE_CONSTANT * 0.5 / INERTIA * time
    assert bench.flywheels.motor_velocity[0] == pytest.approx(expected, rel=1e-9)


def test_velocity_mode_reaches_the_velocity_asked_for(open_bench):
    bench = open_bench()
    bench.bring_up(Mode.CYCLIC_SYNCHRONOUS_VELOCITY)
    bench.run(1500, lambda k: 3 * COUNTS)  # 3 turns per second
    assert bench.flywheels.motor_velocity[0] == pytest.approx(3 * 2 * math.pi, rel=0.01)


def test_enabling_does_not_move_the_axis(open_bench):
    bench = open_bench()
    bench.flywheels.motor_angle = np.array([7.0])
    bench.run(1)
    bench.bring_up()
    frames = bench.run(200)
    position = bench.values(frames, "position")
    assert np.ptp(position) <= 1
    assert position[0] == math.floor(7.0 * COUNTS / (2 * math.pi))


def test_a_session_repeated_gives_the_same_numbers(open_bench, axis):
    runs = []
    for _ in range(2):
        bench = open_bench(axis(current_noise=0.05), seed=7)
        bench.bring_up()
        frames = bench.run(500, swing(0.2, 2.0))
        samples = frames[np.isin(frames["can_id"], (0x80, 0x185))]  # heartbeats go by the wall clock
        runs.append(samples.tobytes())
    assert runs[0] == runs[1]


def test_a_step_that_cannot_be_followed_is_a_following_error(open_bench, axis):
    bench = open_bench(axis(following_error=0.5, following_error_time=0.05))
    bench.bring_up()
    frames = bench.run(2000, lambda k: 200 * COUNTS)
    states = [state_of(int(word)) for word in bench.values(frames, "statusword")]
    assert states[-1] is State.FAULT
    with pytest.raises(DriveError, match="0x8611 following error is too large"):
        bench.drive.enable()
    assert abs(bench.flywheels.motor_velocity[0]) < 0.1
    emergency = frames[frames["can_id"] == 0x85]
    assert len(emergency) == 1
    assert bytes(emergency[0]["data"][:3]) == b"\x11\x86\x21"  # generic, device profile specific


def test_the_current_limit_holds_and_is_shown(open_bench, axis):
    bench = open_bench(axis(current_limit=1.5))
    bench.bring_up(Mode.CYCLIC_SYNCHRONOUS_VELOCITY)
    frames = bench.run(60, lambda k: 50 * COUNTS)
    command = bench.values(frames, "command")
    assert command.max() == 1500
    assert bench.values(frames, "statusword")[-1] & INTERNAL_LIMIT_ACTIVE


def test_quick_stop_brings_the_axis_to_rest_on_its_ramp(open_bench, axis):
    bench = open_bench(axis(quick_stop_deceleration=50.0))  # rad/s²
    bench.bring_up(Mode.CYCLIC_SYNCHRONOUS_VELOCITY)
    bench.run(1000, lambda k: 5 * COUNTS)
    speed = bench.flywheels.motor_velocity[0]
    bench.run(300, lambda k: 5 * COUNTS, controlword=0x02)
    assert bench.drive.state() is State.QUICK_STOP_ACTIVE
    assert bench.flywheels.motor_velocity[0] == pytest.approx(speed - 50.0 * 0.3, rel=0.03)
    bench.run(1000, lambda k: 5 * COUNTS, controlword=0x02)
    assert bench.drive.state() is State.SWITCH_ON_DISABLED
    assert abs(bench.flywheels.motor_velocity[0]) < 0.1


def test_a_quick_stop_without_sync_comes_to_rest_by_the_wall_clock(open_bench, axis):
    """A drive that makes no fault of a lost SYNC: on a busy machine SYNC is lost before the quick stop comes."""
    bench = open_bench(axis(sync_loss="run-on"), sync_timeout=0.05)
    bench.bring_up(Mode.CYCLIC_SYNCHRONOUS_VELOCITY)
    bench.run(500, lambda k: 2 * COUNTS)
    bench.drive.quick_stop()
    assert bench.drive.state() is State.SWITCH_ON_DISABLED
    assert abs(bench.flywheels.motor_velocity[0]) < 0.1


def test_a_lost_sync_is_a_fault_and_the_axis_comes_to_rest(open_bench):
    bench = open_bench(sync_timeout=0.05)
    bench.bring_up(Mode.CYCLIC_SYNCHRONOUS_VELOCITY)
    bench.run(500, lambda k: 2 * COUNTS)
    watch = bench.drive.watch
    assert watch.wait_for(lambda: bool(watch.emergencies), 5.0)
    assert watch.emergencies[0].code == 0x8700
    with pytest.raises(DriveError, match="SYNC was lost"):
        bench.drive.enable()
    assert abs(bench.flywheels.motor_velocity[0]) < 0.1


def test_a_process_that_was_held_up_does_not_take_its_own_stall_for_a_lost_sync(open_bench, monkeypatch):
    bench = open_bench(sync_timeout=1.0)
    bench.bring_up(Mode.CYCLIC_SYNCHRONOUS_VELOCITY)
    bench.run(100, lambda k: 2 * COUNTS)
    clock = SimulatedClock(time.monotonic_ns())
    monkeypatch.setattr("drivers.simulated.rig.time", SimpleNamespace(monotonic=lambda: clock.now * 1e-9))
    codes, pause = [], threading.Event()
    bench.drive.watch.on_emergency = lambda emergency: codes.append(emergency.code)

    def look_after(seconds):
        """The drives look around once, `seconds` after their last look."""
        before = bench.rig._awake
        clock.advance(round(seconds * 1e9))
        while True:
            with bench.rig._lock:
                if bench.rig._awake > before:
                    return
            pause.wait(0.001)

    look_after(60.0)
    assert bench.drive.state() is State.OPERATION_ENABLED
    bench.run(100, lambda k: 2 * COUNTS)
    looks = 0
    while not codes and looks < 50:
        look_after(0.1)
        looks += 1
    assert codes[0] == 0x8700
    assert 10 <= looks <= 12


def test_a_master_that_falls_silent_stops_the_axis(open_bench):
    bench = open_bench(sync_timeout=30.0)
    bench.bring_up(Mode.CYCLIC_SYNCHRONOUS_VELOCITY)
    bench.drive.watch_master(127, 0.05)
    bench.receiver.send(0x77F, b"\x05")
    bench.run(500, lambda k: 2 * COUNTS)
    watch = bench.drive.watch
    assert watch.wait_for(lambda: bool(watch.emergencies), 5.0)
    assert watch.emergencies[0].code == 0x8130


def test_halt_stops_an_interpolated_motion_and_lets_it_go_on_while_the_drive_stays_enabled(open_bench):
    bench = open_bench()
    bench.bring_up(Mode.INTERPOLATED_POSITION)
    enabled = Command.ENABLE_OPERATION | ENABLE_INTERPOLATION
    start = bench.drive.position()
    bench.run(200, lambda cycle: start + 50 * cycle, enabled)
    assert bench.drive.position() > start + 5000
    bench.run(300, lambda cycle: start + 10_000 + 50 * cycle, enabled | HALT)
    stopped = bench.drive.position()
    bench.run(100, lambda cycle: start + 25_000 + 50 * cycle, enabled | HALT)
    assert bench.drive.position() == pytest.approx(stopped, abs=20)
    word = bench.drive.statusword()
    assert state_of(word) is State.OPERATION_ENABLED
    assert word & TARGET_REACHED
    bench.run(200, lambda cycle: stopped + 50 * cycle, enabled)
    assert bench.drive.position() > stopped + 5000


@pytest.mark.parametrize("method", [35, 37])
def test_homing_on_the_spot_makes_here_the_home_offset(open_bench, method):
    bench = open_bench()
    bench.flywheels.motor_angle = np.array([3.0])
    bench.run(1)
    bench.bring_up()
    bench.drive.sdo.write(0x607C, 0, "int32", 1234)
    bench.drive.home(method)
    assert bench.drive.position() == 1234


@pytest.mark.parametrize(("method", "turn"), [(33, 2), (34, 3)])
def test_homing_on_the_index_pulse_goes_to_the_next_turn(open_bench, axis, method, turn):
    """The encoder's turns begin at multiples of 2π of the motor; backwards for 33, forwards for 34."""
    bench = open_bench(sync_timeout=0.05)
    bench.flywheels.motor_angle = np.array([2 * math.pi * 2.4])
    bench.run(1)
    bench.bring_up()
    bench.drive.sdo.write(0x6099, 1, "uint32", 4 * COUNTS)
    bench.drive.home(method)
    pulse = 2 * math.pi * turn
    counts_since_pulse = (bench.flywheels.motor_angle[0] - pulse) * COUNTS / (2 * math.pi)
    assert bench.drive.position() == pytest.approx(counts_since_pulse, abs=COUNTS * 0.01)


def test_homing_that_does_not_end_is_an_error(open_bench):
    bench = open_bench(sync_timeout=0.05)
    bench.bring_up()
    bench.run(10)
    bench.drive.sdo.write(0x6099, 1, "uint32", 0)
    bench.drive.timeouts = replace(bench.drive.timeouts, homing=0.2)
    with pytest.raises(DriveError, match=r"homing .*expected homing attained within 0\.2 s"):
        bench.drive.home(34)


def test_time_stands_still_while_no_axis_has_power(open_bench):
    bench = open_bench()
    bench.flywheels.motor_velocity = np.array([10.0])
    bench.run(100)
    assert bench.flywheels.motor_angle[0] == 0.0
    assert bench.rig.time == 0.0


def test_an_axis_without_power_is_held_while_another_moves(open_bench, axis):
    bench = open_bench(axis(node=1), axis(node=2))
    bench.bring_up(Mode.CYCLIC_SYNCHRONOUS_VELOCITY)
    bench.drives[1].disable()

    def first_only(cycle):
        return 2 * COUNTS

    first = bench.streams[0]
    bench.streams = [first]
    bench.run(1000, first_only)
    assert bench.flywheels.motor_velocity[0] == pytest.approx(4 * math.pi, rel=0.02)
    assert abs(bench.flywheels.motor_angle[1]) < 1e-3


def test_the_servo_settings_are_the_loop_s_gains(open_bench, axis):
    """At rest with a position error e and no integral action: current = K_v·K_p·e."""
    servo = ServoSettings(position_gain=10.0, velocity_gain=2.0, velocity_integral=0.0)
    bench = open_bench(axis(servo=servo))
    bench.bring_up()
    bench.flywheels.step = lambda current, duration: None  # blocked shaft
    frames = bench.run(20, lambda k: 100)  # counts
    expected = 2.0 * 10.0 * 100 * 2 * math.pi / COUNTS  # A
    assert bench.values(frames, "command")[-1] == pytest.approx(expected / 5.0 * 1000, abs=0.5)


def test_a_drive_enabled_after_an_earlier_session_waits_for_sync_without_a_fault(open_bench):
    bench = open_bench(sync_timeout=0.05)
    bench.bring_up()
    bench.run(10)
    bench.drive.disable()
    bench.drive.enable()
    watch = bench.drive.watch
    assert not watch.wait_for(lambda: bool(watch.emergencies), 0.2)
    assert bench.drive.state() is State.OPERATION_ENABLED


def test_a_rig_that_is_closed_leaves_no_thread_and_one_that_never_ran_is_closed_too(open_bench):
    bench = open_bench()
    made = SimulatedRig(
        bench.settings, BusSettings(interface="virtual", channel="closed twice"), bench.flywheels
    )
    made.close()
    before = set(threading.enumerate())
    with SimulatedRig(
        bench.settings, BusSettings(interface="virtual", channel="closed twice"), bench.flywheels
    ) as rig:
        started = [each for each in set(threading.enumerate()) - before if each.name == "simulated-rig"]
        assert len(started) == 1
    assert not started[0].is_alive()
    rig.close()
