"""Stopping escalates: what a quick stop does not bring to rest loses its power, and what is left is said."""

import pytest

from daq.safety import StopCause
from drivers.safety_output import SafetyOutputSettings
from drivers.simulated.faults import ENCODER_STANDS, SHOWN_STANDS
from tests.faults.bench import bench_rig, is_safe, run


def fast(*faults: tuple[str, int], phase: str = "fast") -> dict:
    """Faults that begin when the motor turns at 50 rad/s, half a radian a second at the joint."""
    return {
        "planned": [{"fault": name, "value": value, "phase": phase, "speed": 50.0} for name, value in faults]
    }


def test_without_a_fault_the_plan_is_driven_and_power_is_read_back_as_off():
    outcome = run(bench_rig())
    assert outcome.reason.cause is StopCause.PLAN_DONE
    assert outcome.reason.words == "the plan ran to its end"
    assert is_safe(outcome)
    assert outcome.alarms == []


@pytest.mark.parametrize("phase", ["slow", "fast"])
def test_a_feedback_that_flips_its_sign_is_cut_before_the_axis_runs_away(phase):
    """In an earlier version it reached 13 rad/s where 1.2 is the limit."""
    outcome = run(bench_rig(**fast(("flip-feedback", 1), phase=phase)))
    assert "power was cut by every means and was read back as off" in outcome.reason.words
    assert is_safe(outcome)
    assert outcome.fastest < 2.0
    assert outcome.travel < 0.3
    assert outcome.powered_for < 0.3


@pytest.mark.parametrize(("phase", "fastest"), [("slow", 3.0), ("fast", 2.0)])
@pytest.mark.parametrize("stands", [ENCODER_STANDS, SHOWN_STANDS])
def test_an_encoder_that_stands_does_not_let_the_axis_be_driven_on(stands, phase, fastest):
    """By the limit of the following error alone, 50 mrad, it reached 7.3 rad/s and went 2.5 rad. An axis that nobody sees is
    cut, and a person told; how far its brake lets it go is the brake's affair."""
    outcome = run(bench_rig(**fast(("feedback-stands", stands), phase=phase)))
    assert outcome.reason.cause is StopCause.LIMIT
    assert not outcome.powered
    assert outcome.fastest < fastest
    assert outcome.travel < (0.1 if stands == SHOWN_STANDS else 0.6)
    assert is_safe(outcome)
    # slow, it is the setpoint that goes on, or all the current; fast, it seems to brake harder than any axis can
    assert ("its position stands at" in outcome.reason.words) == (phase == "slow")
    assert ("keep clear until you see it rest" in outcome.ended_alarm) == (phase == "slow")


def test_an_axis_whose_encoder_never_told_is_stopped_before_the_approach():
    """Power comes, the brake opens, and nobody holds what falls: by its setpoint alone it went 1.3 rad at 4.1 rad/s where the
    encoder stood some counts beside its target, so that the drive's integral grew."""
    stands = {"fault": "feedback-stands", "value": ENCODER_STANDS, "phase": "streaming", "after": 30}
    outcome = run(bench_rig(planned=[stands]))
    assert "while its drive gave 18 A" in outcome.reason.words
    assert outcome.travel < 0.6
    assert outcome.fastest < 2.0
    assert is_safe(outcome)


def test_a_drive_that_obeys_no_controlword_is_reset():
    outcome = run(bench_rig(**fast(("run-away", 1_500_000), ("disobey", 1))))
    assert "and was read back as off" in outcome.reason.words
    assert is_safe(outcome)
    assert outcome.travel < 0.6
    assert outcome.powered_for < 0.6


def test_a_drive_that_obeys_nothing_at_all_has_a_person_told_to_press_the_emergency_stop():
    outcome = run(bench_rig(**fast(("run-away", 1_500_000), ("disobey", 1), ("deaf-to-nmt", 1))))
    assert outcome.powered
    assert any("press the emergency stop" in words for words in outcome.alarms)
    assert "was not read back as off" in outcome.reason.words
    assert "press the emergency stop" in outcome.ended_alarm


def test_a_plan_that_ran_to_its_end_has_not_ended_well_where_power_stays_on():
    outcome = run(bench_rig(**fast(("disobey", 1), ("deaf-to-nmt", 1))))
    assert outcome.powered
    assert outcome.reason.cause is StopCause.POWER_NOT_OFF
    assert sum("may still have power" in words for words in outcome.alarms) == 1, outcome.alarms
    assert outcome.reason.words.startswith(
        "the plan ran to its end; a drive still had power: power was cut by"
    )
    assert "was not read back as off" in outcome.reason.words


def test_a_drive_that_somebody_stopped_by_nmt_is_reset_and_read_back():
    outcome = run(bench_rig(**fast(("nmt-state", 4))))
    assert outcome.reason.cause is StopCause.SILENT_DRIVE
    assert "and was read back as off" in outcome.reason.words
    assert is_safe(outcome)


def test_a_frozen_drive_is_not_said_to_be_switched_off():
    outcome = run(bench_rig(**fast(("freeze", 1))))
    assert outcome.powered
    assert "does not answer" in outcome.reason.words
    assert "press the emergency stop" in outcome.ended_alarm
    assert "switched off" not in outcome.reason.words


@pytest.mark.parametrize(
    ("fault", "value", "named"),
    [
        ("foreign-sync", 1, "a SYNC (0x080) that is not ours"),
        ("foreign-setpoint", 3000, "setpoints (0x203) for node 3 that are not ours"),
        ("foreign-nmt", 2, "an NMT command (0x000) that is not ours"),
    ],
)
def test_a_second_master_is_stopped_and_named(fault, value, named):
    outcome = run(bench_rig(**fast((fault, value))))
    assert outcome.reason.cause is StopCause.FOREIGN_MASTER
    assert named in outcome.reason.words
    assert is_safe(outcome)
    assert outcome.travel < 0.2


def test_a_fault_of_the_drive_while_it_is_being_stopped_is_told_too():
    rig = bench_rig(planned=[{"fault": "emergency", "value": 0x4310, "phase": "stopping"}])
    outcome = run(rig, stop_when=lambda plant, trace: abs(plant.mechanism.joint_velocity) > 0.5)
    assert outcome.reason.cause is StopCause.OPERATOR
    assert (
        "while stopping: joint j3 (node 3): EMCY 0x4310 motor or transmission too hot" in outcome.reason.words
    )
    assert is_safe(outcome)


def test_an_axis_without_a_brake_falls_when_its_power_goes():
    """The plant's own law: without it no stop could be judged."""
    outcome = run(bench_rig(brake=False, **fast(("flip-feedback", 1))))
    assert not outcome.powered
    assert outcome.travel > 0.5
    assert "power was cut" in outcome.reason.words


def test_a_cut_uses_the_output_that_the_rig_file_names(tmp_path):
    """A drive that obeys nothing: the relay is what is left, and the alarm stays, for nothing can be read back."""
    relay = tmp_path / "relay"
    relay.write_bytes(b"")
    rig = bench_rig(**fast(("run-away", 1_500_000), ("disobey", 1), ("deaf-to-nmt", 1)))
    output = SafetyOutputSettings(path=str(relay), write="A00101A2")
    outcome = run(rig.model_copy(update={"safety_output": output}))
    assert relay.read_bytes().startswith(bytes.fromhex("A00101A2"))
    assert "press the emergency stop" in outcome.ended_alarm


def test_without_a_cut_the_output_is_left_alone(tmp_path):
    relay = tmp_path / "relay"
    relay.write_bytes(b"")
    output = SafetyOutputSettings(path=str(relay), write="A00101A2")
    outcome = run(bench_rig().model_copy(update={"safety_output": output}))
    assert outcome.reason.cause is StopCause.PLAN_DONE
    assert relay.read_bytes() == b""
