"""What the simulated drives of a rig are where its section is silent: what the rig says of them."""

from __future__ import annotations

import math

import pytest

from daq.rig import RIGS, Rig
from daq.simulated_rig import _drives, _section, simulated_rig
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload

NOTHING = Payload(name="none", mass=0.0)


@pytest.fixture(scope="module")
def rig():
    return Rig.load(RIGS / "rx130l-joint3-simulated.yaml")


def changed(rig, axis=(), **section):
    return rig.model_copy(
        update={
            "axes": tuple(each.model_copy(update=dict(axis)) for each in rig.axes),
            "simulated": {**rig.simulated, **section},
        }
    )


def drives_of(rig, in_process=True, seed=0):
    return _drives(rig, _section(rig), in_process, seed)


def test_a_drive_is_what_the_rig_says_of_it(rig):
    (axis,), (believed,) = drives_of(changed(rig, drives=[])).axes, rig.axes
    assert axis.node == believed.node
    assert axis.counts_per_turn == believed.encoder_counts
    home = (rig.motor_gear @ rig.position_offset)[0]  # rad of the motor where the encoder counts from
    assert axis.position_offset == round(-home / (2 * math.pi) * believed.encoder_counts)


@pytest.mark.parametrize(
    ("torque", "current", "expected"),
    [(3.0, 2.0, (3.0, 2.0)), (3.0, None, (3.0, 6.0)), (None, 2.0, (1.0, 2.0)), (None, None, (2.5, 5.0))],
)
def test_a_rating_that_is_missing_follows_from_the_other_and_the_motor(rig, torque, current, expected):
    stated = {"rated_torque": torque, "rated_current": current, "torque_constant": 0.5}
    (axis,) = drives_of(changed(rig, stated, drives=[])).axes
    assert (axis.rated_torque, axis.rated_current) == pytest.approx(expected)


def test_what_the_section_says_of_a_drive_goes_before_what_the_rig_believes(rig):
    (axis,) = drives_of(changed(rig, drives=[{"counts_per_turn": 4096, "current_noise": 0.25}])).axes
    assert (axis.counts_per_turn, axis.current_noise, axis.node) == (4096, 0.25, rig.axes[0].node)


@pytest.mark.parametrize(
    ("given", "in_process", "timeout"),
    [
        ({}, True, 30.0),
        ({}, False, 0.25),
        ({"sync_timeout": 2.0}, True, 2.0),
        ({"sync_timeout": 2.0}, False, 2.0),
    ],
)
def test_drives_wait_long_for_a_sync_only_where_nobody_else_could_record_that_it_fails(
    rig, given, in_process, timeout
):
    section = {key: value for key, value in rig.simulated.items() if key != "sync_timeout"}
    stated = rig.model_copy(update={"simulated": {**section, **given}})
    assert drives_of(stated, in_process).sync_timeout == timeout


@pytest.mark.parametrize(("cycle", "after"), [(0.002, 0.02), (0.02, 0.05)])
def test_in_real_time_what_moves_goes_on_when_a_sync_is_two_and_a_half_cycles_late(rig, cycle, after):
    real = rig.model_copy(update={"pacing": "real-time", "cycle": cycle})
    assert drives_of(real).run_on_after == pytest.approx(after)
    assert drives_of(rig.model_copy(update={"pacing": "as-fast-as-possible"})).run_on_after is None


def test_sessions_differ_in_their_noise_by_the_number_that_is_added_to_the_seed(rig):
    assert drives_of(changed(rig, seed=7), seed=3).seed == 10
    assert drives_of(changed(rig, seed=7)).seed == 7


@pytest.mark.parametrize(
    ("section", "said"),
    [
        ({"drives": [{}, {}]}, "simulated.drives: 1 axes need 1 entries or none"),
        (
            {"drives": [{"brake_delay": -1}]},
            "simulated.drives.brake_delay: Input should be greater than or equal to 0",
        ),
        ({"servo_period": 0.02}, "simulated.servo_period: Input should be less than or equal to 0.01"),
        ({"colour": 1}, "simulated.colour: Extra inputs are not permitted"),
    ],
)
def test_a_section_that_is_wrong_is_refused_by_rig_and_field(rig, section, said):
    with pytest.raises(InputError) as refused:
        simulated_rig(changed(rig, **section), NOTHING)
    assert str(refused.value) == f"rig {rig.name}: {said}"


def test_a_real_rig_has_no_simulated_drives(rig):
    with pytest.raises(InputError, match=r"is not simulated \(it has no section `simulated`\)"):
        simulated_rig(rig.model_copy(update={"simulated": None}), NOTHING)
