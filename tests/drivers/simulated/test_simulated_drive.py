"""The simulated drive's own arithmetic: encoder, modes, amplifier, supervision; without a bus or an arm."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drivers import cia402
from drivers.cia402 import Mode, State
from drivers.simulated import process_image as slot
from drivers.simulated.faults import ENCODER_STANDS, SHOWN_STANDS, Faults, FaultSettings
from drivers.simulated.servo import Servo
from drivers.simulated.settings import ServoSettings, SimulatedAxis
from drivers.simulated.simulated_drive import SimulatedDrive

STEP = 1e-3  # s, servo period


def enabled_drive(mode: Mode, **settings: object) -> SimulatedDrive:
    """A drive in OPERATION ENABLED, in a mode, at rest at motor angle zero."""
    axis = SimulatedAxis.model_validate({"node": 1, "counts_per_turn": 3600, **settings})
    drive = SimulatedDrive(axis, Faults(FaultSettings(), seed=1), seed=1)
    drive.sample(0.0, 25.0)
    drive.start()
    drive.image[slot.MODE] = mode
    drive.take_mode()
    for controlword in (0x06, 0x07, 0x0F):  # shutdown, switch on, enable operation
        drive.image[slot.CONTROLWORD] = controlword
        drive.take_controlword()
    assert drive.machine.state is State.OPERATION_ENABLED
    return drive


def angle_of(counts: float) -> float:
    """rad of the motor in the middle of an encoder's count, 3600 a turn."""
    return (counts + 0.5) * 2 * math.pi / 3600


@pytest.mark.parametrize("filter_time", [0.0, 2e-3])
def test_the_drive_believes_a_velocity_behind_a_low_pass_of_first_order(filter_time):
    axis = SimulatedAxis(node=1, servo=ServoSettings(velocity_filter=filter_time))
    servo = Servo(axis)
    servo.observe(100, 1e-3)
    assert servo.velocity == 0.0  # one position tells nothing
    servo.observe(140, 1e-3)
    first = 40_000.0 * (1.0 if filter_time == 0.0 else 1.0 - math.exp(-0.5))
    assert servo.velocity == pytest.approx(first)
    servo.shift(1000)  # another zero is no motion
    servo.observe(1140, 1e-3)
    assert servo.velocity == pytest.approx(0.0 if filter_time == 0.0 else first * math.exp(-0.5))


def test_an_encoder_whose_sign_changes_goes_on_from_where_it_is():
    drive = enabled_drive(Mode.CYCLIC_SYNCHRONOUS_POSITION, position_offset=1000)
    assert [drive.encoder(angle_of(counts)) for counts in (-3, 0, 7)] == [997, 1000, 1007]
    drive.faults.feedback_flips = True
    assert [drive.encoder(angle_of(counts)) for counts in (7, 9, 0, -5)] == [1007, 1005, 1014, 1019]


def test_an_encoder_that_stands_shows_where_it_was_to_the_drive_or_to_others_alone():
    drive = enabled_drive(Mode.CYCLIC_SYNCHRONOUS_POSITION)
    drive.sample(angle_of(40), 20.0)
    drive.faults.feedback_stands = SHOWN_STANDS
    drive.sample(angle_of(90), 20.0)
    assert (drive.image[slot.POSITION], drive.encoder(angle_of(90))) == (40, 90)
    drive.faults.feedback_stands = ENCODER_STANDS
    assert [drive.encoder(angle_of(counts)) for counts in (95, 200)] == [95, 95]
    drive.sample(angle_of(300), 20.0)
    assert drive.image[slot.POSITION] == 95


def test_what_is_measured_is_shown_in_the_objects_units_and_a_glitch_once():
    drive = enabled_drive(Mode.CYCLIC_SYNCHRONOUS_POSITION)
    drive.faults.glitch = 500
    drive.sample(angle_of(40), 31.26)
    assert (drive.image[slot.POSITION], drive.image[slot.TEMPERATURE]) == (540, 313)
    drive.sample(angle_of(40), 31.24)
    assert (drive.image[slot.POSITION], drive.image[slot.TEMPERATURE]) == (40, 312)


def commanded(drive: SimulatedDrive, per_mille: int, offset: int = 0) -> float:
    """The amplifier's current for a torque target, of a motor at rest."""
    drive.image[slot.TARGET_TORQUE], drive.image[slot.TORQUE_OFFSET] = per_mille, offset
    return drive.servo_step(0.0, 0.0, STEP)


def test_a_torque_target_is_a_current_in_parts_of_the_rated_one_up_to_the_limit():
    drive = enabled_drive(Mode.CYCLIC_SYNCHRONOUS_TORQUE, rated_current=4.0, current_limit=2.0)
    assert commanded(drive, 250, offset=50) == pytest.approx(1.2)
    assert drive.image[slot.TORQUE] == drive.image[slot.CURRENT] == drive.image[slot.TORQUE_DEMAND] == 300
    assert not drive.servo.limited
    assert commanded(drive, -2500) == pytest.approx(-8.0)
    assert drive.servo.limited
    drive.faults.current_left = 0.25
    assert commanded(drive, 2500) == pytest.approx(2.0)
    drive.faults.current_stuck = True
    commanded(drive, 200)
    assert (drive.image[slot.TORQUE_DEMAND], drive.image[slot.TORQUE]) == (0, 200)


def test_the_noise_of_the_current_acts_and_is_measured_and_the_demand_is_without_it():
    drive = enabled_drive(Mode.CYCLIC_SYNCHRONOUS_TORQUE, rated_current=4.0, current_noise=0.1)
    acting, shown = [], []
    for _ in range(2000):
        acting.append(commanded(drive, 500))
        shown.append(drive.image[slot.TORQUE] * 4.0 / 1000)
        assert drive.image[slot.TORQUE_DEMAND] == 500
        assert drive.image[slot.CURRENT] == drive.image[slot.TORQUE]
    np.testing.assert_allclose(shown, acting, atol=0.0021)  # half a per mille of the rated current
    assert np.mean(acting) == pytest.approx(2.0, abs=4 * 0.1 / np.sqrt(2000))
    assert np.std(acting) == pytest.approx(0.1, rel=0.1)


def test_a_setpoint_is_reached_within_the_cycle_along_a_line_and_within_the_softwares_limits():
    drive = enabled_drive(Mode.CYCLIC_SYNCHRONOUS_POSITION)
    drive.software_limits = (-50, 80)
    drive.image[slot.TARGET_POSITION], drive.image[slot.POSITION_OFFSET] = 30, 10
    drive.activate_setpoints(0.01)
    drive.servo_step(0.0, 0.0025, STEP)
    assert (drive.image[slot.POSITION_DEMAND], drive.image[slot.FOLLOWING_ERROR]) == (10, 10)
    drive.servo_step(angle_of(5), 0.01, STEP)
    assert (drive.image[slot.POSITION_DEMAND], drive.image[slot.FOLLOWING_ERROR]) == (40, 35)
    for target, reached in ((1000, 80), (-1000, -50)):
        drive.image[slot.TARGET_POSITION] = target
        drive.activate_setpoints(0.01)
        drive.servo_step(0.0, 0.01, STEP)
        assert drive.image[slot.POSITION_DEMAND] == reached


def test_a_demand_that_runs_away_goes_on_with_its_speed_whatever_the_target():
    drive = enabled_drive(Mode.CYCLIC_SYNCHRONOUS_POSITION, current_limit=3.0, rated_current=5.0)
    drive.faults.run_away = 40_000
    current = [drive.servo_step(0.0, 0.0, STEP) for _ in range(200)]
    assert current[-1] == 15.0  # the limit: it pushes, though the target is where it stands
    drive.faults.run_away = 0
    drive.image[slot.TARGET_POSITION] = 0
    drive.activate_setpoints(0.01)
    drive.faults.run_away = -40_000
    assert min(drive.servo_step(0.0, 0.0, STEP) for _ in range(600)) == -15.0


def test_a_following_error_is_a_fault_once_it_has_lasted_longer_than_its_time():
    drive = enabled_drive(
        Mode.CYCLIC_SYNCHRONOUS_POSITION, following_error=0.1, following_error_time=5 * STEP
    )
    drive.image[slot.TARGET_POSITION] = 361  # the window is 360 counts
    drive.activate_setpoints(0.01)
    for _ in range(4):
        drive.servo_step(angle_of(0), 0.01, STEP)
    drive.servo_step(angle_of(1), 0.01, STEP)  # within the window: counted from the beginning again
    states = []
    for _ in range(7):
        drive.servo_step(angle_of(0), 0.01, STEP)
        states.append(drive.machine.state)
    assert states[4] is State.OPERATION_ENABLED
    assert states[6] is not State.OPERATION_ENABLED
    assert drive.image[slot.ERROR_CODE] == 0x8611
    assert drive.image[slot.STATUSWORD] & cia402.FOLLOWING_ERROR


def test_an_axis_that_loses_power_in_motion_is_free_until_its_brake_has_settled_for_a_fifth_of_a_second():
    drive = enabled_drive(Mode.CYCLIC_SYNCHRONOUS_POSITION, brake=True, brake_delay=2 * STEP)
    for count in range(5):
        drive.servo_step(angle_of(3 * count), 0.0, STEP)  # 3000 counts/s
    drive.image[slot.CONTROLWORD] = 0x00  # disable voltage
    drive.take_controlword()
    assert drive.free
    assert drive.servo_step(angle_of(15), 0.0, STEP) == 0.0  # the brake is still open
    assert drive.servo_step(angle_of(18), 0.0, STEP) < 0.0  # it slips, against the motion
    standing = 0
    while drive.free and standing < 1000:
        drive.servo_step(angle_of(18), 0.0, STEP)
        standing += 1
    assert standing * STEP == pytest.approx(0.2, abs=8 * STEP)  # the servo sees it stand a little later


def test_a_fault_that_is_reset_leaves_neither_code_nor_register():
    drive = enabled_drive(Mode.CYCLIC_SYNCHRONOUS_POSITION)
    drive.fail(0x8611)
    for _ in range(100):  # the fault reaction stops the axis and takes its power away
        drive.servo_step(angle_of(0), 0.0, STEP)
    assert drive.machine.state is State.FAULT
    assert drive.image[slot.ERROR_CODE] == 0x8611
    assert drive.image[slot.ERROR_REGISTER] & 0x01
    for controlword in (0x00, 0x80):
        drive.image[slot.CONTROLWORD] = controlword
        drive.take_controlword()
    assert drive.machine.state is State.SWITCH_ON_DISABLED
    assert (drive.image[slot.ERROR_CODE], drive.image[slot.ERROR_REGISTER]) == (0, 0)


@pytest.mark.parametrize("method", [33, 34])
def test_homing_goes_to_the_next_index_pulse_one_way_or_the_other_and_calls_it_the_home_offset(method):
    """CiA 402: 33 backwards, 34 forwards. Index pulses lie at whole turns, 3600 counts; the axis stands 1000 past one."""
    drive = enabled_drive(Mode.HOMING)
    drive.homing_method, drive.home_offset = method, 250
    drive.sample(angle_of(1000), 25.0)
    drive.image[slot.CONTROLWORD] = 0x0F | cia402.START_HOMING
    drive.take_controlword()
    assert drive.homing
    way = 1 if method == 34 else -1
    assert drive.servo_step(angle_of(1000), 0.0, STEP) * way > 0.0
    index = 3600 if method == 34 else 0
    passed = index + (10 if method == 34 else -10)
    drive.servo_step(angle_of(passed), 0.0, STEP)
    assert not drive.homing
    drive.sample(angle_of(passed), 25.0)
    assert drive.image[slot.POSITION] == 250 + passed - index
    assert drive.encoder(angle_of(index)) == 250


def test_a_quick_stop_falls_by_the_deceleration_that_the_axis_states():
    """500 rad/s² of the motor are 286479 counts/s² of an encoder of 3600 counts."""
    drive = enabled_drive(Mode.CYCLIC_SYNCHRONOUS_VELOCITY, quick_stop_deceleration=500.0)
    assert drive.quick_stop_deceleration == pytest.approx(500.0 * 3600 / (2 * math.pi))
