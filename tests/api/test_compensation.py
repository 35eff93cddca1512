"""The proof on the drive: a model's feedforward torque over the (virtual) bus makes the simulated RX130L follow better; what
could do harm is refused before, or stopped."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import api.compensation
from api.compensation import friction_work, shared_motor_remarks, torque_ahead
from api.compensation_run import PICTURE, CompensationRun
from api.proof import (
    DOCUMENT,
    Proof,
    first_recording,
    following_limits,
    next_folder,
    read_conclusion,
    read_errors,
)
from daq.excitation.standard_plan import standard_plan
from daq.experiment_folder import experiment_robot
from daq.following_error import FollowingError
from daq.rig import Rig
from daq.session_events import SessionState, StepOutOfTurn
from daq.session_workflow import PayloadSession
from daq.torque_offset import RAMP, torque_offset
from identify.dynamics.base_parameters import base_parameters
from identify.dynamics.geometry import Geometry
from identify.effects.model import load_shares, motor_shares
from identify.export.exported_model import ExportedModel, Torque, exported_model, of_motor
from identify.export.planned_torque import planned_torque
from identify.export.record_error import Motion
from identify.identification import identify
from identify.recording import InputError, load_experiment
from identify.results.compensation import CompensationDocument
from identify.simulation.controller import estimated_controllers
from identify.simulation.measured_motion import measured_motions
from tests.api.driven_arm import short_plan
from tests.api.proof_settings import proof_settings

RIG = "rx130l-joint3-simulated"
PAYLOAD = "disk-3.5"


@pytest.fixture(scope="module")
def rig():
    return Rig.load(RIG)


@pytest.fixture(scope="module")
def plan(rig):
    """Shorter than what is identified from."""
    return standard_plan(rig, 18.1)


def drive(session):
    with session:
        assert session.check().ok
        session.confirm_payload(session.payload.mass)
        session.arm()
        session.start()
        return session.wait(200.0)


@pytest.fixture(scope="module")
def experiment(rig, tmp_path_factory):
    """Two payload sessions of the same machine."""
    folder = tmp_path_factory.mktemp("proof") / "rx130l"
    motion = standard_plan(rig, 25.0)
    for name in ("none", "disk-7"):
        assert drive(PayloadSession(rig, folder, motion, rig.payload(name), "operator")) is SessionState.DONE
    return folder


@pytest.fixture(scope="module")
def result(experiment):
    return identify(load_experiment(experiment), "load-velocity")


def proof(rig, experiment, plan, ahead):
    """Both drives of the plan, and what is stored of them."""
    run = CompensationRun(
        Proof(next_folder(experiment), proof_settings(rig, "rx130l", rig.payload(PAYLOAD)), rig, plan, ahead),
        seed=3,
    )
    assert drive(run.without()) is SessionState.DONE
    state = drive(run.with_torque())
    return state, run, run.document()


def test_the_model_halves_the_following_error_and_the_usual_one_does_less(rig, experiment, plan, result):
    payload = rig.payload(PAYLOAD)
    state, run, found = proof(rig, experiment, plan, torque_ahead(result, rig, plan, payload, "whole", 0.6))
    assert state is SessionState.DONE
    (joint,) = found.joints
    assert joint.rms_with < 0.5 * joint.rms_without
    assert joint.peak_with < joint.peak_without
    assert joint.bounded == 0.0
    assert {own.where for own in joint.quadrants} == {"driving its load", "driven by its load"}
    assert all(own.rms_with < own.rms_without for own in (*joint.speeds, *joint.quadrants))
    folder = run.proof.folder
    assert CompensationDocument.model_validate_json((folder / DOCUMENT).read_text()) == found
    assert b"<svg" in (folder / PICTURE).read_bytes()
    # the pair stands with the experiment, and is no session that the model is fitted to
    assert folder == experiment / found.folder
    assert [entry.role for entry in load_experiment(folder).sessions] == ["validation"] * 2
    # whoever comes later finds what was sent, and what came of it, cycle by cycle
    again = Proof.load(folder, rig)
    assert np.array_equal(again.ahead.offset.counts, run.proof.ahead.offset.counts)
    assert again.settings == run.proof.settings
    assert read_conclusion(folder) == found
    errors = read_errors(folder)
    assert np.sqrt(np.nanmean(errors.after**2)) == pytest.approx(joint.rms_with, rel=0.02)
    (folder / "ahead.npz").write_bytes(b"half of it")
    with pytest.raises(InputError, match="prepare another proof"):
        Proof.load(folder, rig)
    assert len(load_experiment(experiment).sessions) == 2
    usual = identify(load_experiment(experiment), "usual")
    _, _, less = proof(rig, experiment, plan, torque_ahead(usual, rig, plan, payload, "whole", 0.6))
    assert joint.rms_with < less.joints[0].rms_with < less.joints[0].rms_without


@pytest.fixture(scope="module")
def half(rig, experiment, result):
    """A proof of 7 s whose run without torque is driven, with the model's torque to be sent."""
    motion = short_plan("short")
    ahead = torque_ahead(result, rig, motion, rig.payload(PAYLOAD), "whole", 0.6)
    settings = proof_settings(rig, "rx130l", rig.payload(PAYLOAD))
    run = CompensationRun(Proof(next_folder(experiment), settings, rig, motion, ahead), seed=3)
    assert drive(run.without()) is SessionState.DONE
    return run.proof


def with_torque(half, torque, seed=4):
    """The second run of the proof where something else arrives in the motor than the model's torque, as by a wrong scale on the
    way: (L, 1), N m. Its end, and how the axis followed."""
    ahead = replace(half.ahead, offset=torque_offset(half.rig, torque, 1.0))
    session = CompensationRun.continued(replace(half, ahead=ahead), seed).with_torque()
    state = drive(session)
    first = half.error(first_recording(half.folder))
    return state, session.reason, first, half.error(session.file)


def driving(ahead):
    return ahead.speed * ahead.load > 0


@pytest.mark.parametrize(
    "wrong",
    [
        lambda ahead: -ahead.torque,
        lambda ahead: -2.0 * ahead.torque,
        lambda ahead: np.where(driving(ahead), -ahead.torque, ahead.torque),
        lambda ahead: np.where(driving(ahead), ahead.torque, -ahead.torque),
        lambda ahead: 3.0 * ahead.torque,
        lambda ahead: 2.0 * ahead.torque,
    ],
    ids=["wrong sign", "wrong sign, twice over", "wrong driving", "wrong driven", "far too much", "doubled"],
)
def test_a_wrong_model_is_stopped_before_it_does_harm(half, wrong):
    """By the same plan without it, place by place. Where the sign changes in motion the torque jumps by twice itself, and the
    axis goes on for the 16 cycles between two looks at the samples in simulated time."""
    state, reason, first, second = with_torque(half, wrong(half.ahead))
    assert state is SessionState.FAULTED
    assert re.search("follow worse|following error grows|turned the following error round", reason)
    assert second.cycle[-1] < 0.8 * first.cycle[-1]
    assert second.peak()[0] < 5.0 * first.peak()[0]
    assert second.peak()[0] < 0.1 * half.rig.axes[0].limits.following_error


def test_a_right_model_is_not_stopped_whatever_the_noise(half):
    state, reason, first, second = with_torque(half, half.ahead.torque, seed=11)
    assert state is SessionState.DONE, reason
    assert second.rms()[0] < 0.5 * first.rms()[0]


def friction(ahead):
    return ahead.torque - ahead.load


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (
            lambda ahead: {"torque": 2.0 * ahead.torque, "load": 2.0 * ahead.load},
            r"0\.5\d? times .* arm and payload",
        ),
        (
            lambda ahead: {"torque": 0.5 * ahead.torque, "load": 0.5 * ahead.load},
            r"[12]\.\d\d times .* arm and payload",
        ),
        (lambda ahead: {"torque": ahead.load - friction(ahead)}, r"-[01]\.\d\d times the model's friction"),
        (
            lambda ahead: {"torque": ahead.load + 2.0 * friction(ahead)},
            r"0\.[45]\d times the model's friction",
        ),
        (
            lambda ahead: {"torque": ahead.torque / 0.55, "load": ahead.load / 0.55},
            r"0\.5\d times .* arm and payload",
        ),
    ],
    ids=["doubled", "halved", "friction reversed", "friction doubled", "stale gains"],
)
def test_a_model_of_another_torque_than_the_first_run_measured_is_never_sent(half, wrong, words):
    other = replace(half, ahead=replace(half.ahead, **wrong(half.ahead)))
    with pytest.raises(InputError, match=f"^the model's torque was not sent: j3: .*{words}"):
        CompensationRun.continued(other).with_torque()
    kept = read_conclusion(half.folder)
    assert (kept.completed, kept.recording_with, kept.joints) == (False, None, ())
    assert kept.reason.startswith("the model's torque was not sent")
    CompensationRun.continued(half).with_torque()


@pytest.mark.parametrize("stated", ["none", "disk-7"])
def test_a_payload_that_weighs_other_than_stated_is_told_by_the_first_run(half, rig, result, stated):
    """disk-3.5, 3.46 kg, is mounted."""
    payload = rig.payload(stated)
    ahead = torque_ahead(result, rig, half.plan, payload, "whole", 0.6)
    other = replace(half, ahead=ahead, settings=proof_settings(rig, "rx130l", payload))
    with pytest.raises(InputError, match=r"the payload weighs 3\.\d kg, .* check what is mounted"):
        CompensationRun.continued(other).with_torque()


def test_what_is_sent_is_bounded_faded_and_in_the_drive_s_unit(rig):
    torque = np.full((2000, 1), 200.0)
    sent = torque_offset(rig, torque, 0.5)
    per_mille = 200.0 / (95.0 * 0.37) * 0.37 / 2.22 * 1000.0
    assert sent.counts[1000, 0] == round(per_mille)
    assert sent.counts[0, 0] == sent.counts[-1, 0] == 0
    fading = int(RAMP / rig.cycle)
    assert np.all(np.diff(sent.counts[:fading, 0]) >= 0)
    assert sent.bounded[0] == 0.0
    bounded = torque_offset(rig, torque, 0.1)
    assert bounded.largest[0] == pytest.approx(0.1 * 18.0)
    assert bounded.bounded[0] == 1.0
    for share in (0.0, 1.5, float("nan")):
        with pytest.raises(InputError, match="--share"):
            torque_offset(rig, torque, share)


def test_a_second_drive_may_double_the_error_of_the_first_and_never_pass_the_rig_s_limit(rig):
    (limit,) = following_limits(rig, FollowingError(np.arange(10), np.full((10, 1), 3e-4)))
    assert 6e-4 < limit < 7e-4
    large = FollowingError(np.arange(10), np.full((10, 1), 0.2))
    assert following_limits(rig, large)[0] == rig.axes[0].limits.following_error


def test_models_that_may_not_be_sent_are_refused_before_anything_moves(rig, plan, result, experiment):
    payload = rig.payload(PAYLOAD)
    heavier = payload.model_copy(update={"mass": 40.0})
    with pytest.raises(InputError, match="load"):
        torque_ahead(result, rig, plan, heavier, "whole", 0.6)
    scaled = rig.axes[0].model_copy(update={"torque_constant": 0.5})
    with pytest.raises(InputError, match="drive gains"):
        torque_ahead(result, rig.model_copy(update={"axes": (scaled,)}), plan, payload, "whole", 0.6)
    other = Rig.load("tx40-simulated")
    with pytest.raises(InputError, match="joints are"):
        torque_ahead(result, other, plan, payload, "whole", 0.6)
    with pytest.raises(InputError, match=r"its joints .* are not those of rig"):
        torque_ahead(result, rig, standard_plan(other, 20.0), payload, "whole", 0.6)
    with pytest.raises(InputError, match="nothing would be sent along this plan"):
        torque_ahead(result, rig, plan, payload, "whole", 1e-9)
    links = identify(load_experiment(experiment), "link-side")
    with pytest.raises(InputError, match="neither rotor inertia nor the friction of motor and gear"):
        torque_ahead(links, rig, plan, payload, "whole", 0.6)


def test_a_model_over_position_or_temperature_is_not_sent_where_it_is_not_known(rig, plan, result):
    model = exported_model(result)
    spring = Torque("joint-spring", 0, 0, ("q",), (3.0,))
    warm = Torque("friction-temperature", 0, 0, ("(temp - 20.0) * direction",), (0.1,))
    cold = Torque("friction-warmup", 0, 0, ("exp(-t / 900.0) * direction",), (2.0,))
    times = np.arange(0.0, plan.duration, 0.01)
    planned = plan.setpoints(times)
    motion = Motion(
        times, planned.position, planned.velocity, planned.acceleration, None, rig.payload(PAYLOAD)
    )
    narrow = replace(motion, q=0.5 * planned.position)
    within = api.compensation._within_positions_and_temperatures
    within(model, motion, [narrow])  # nothing of this model looks at the position
    within(replace(model, torques=(spring,)), motion, [motion])
    with pytest.raises(InputError, match="joint-spring was identified from"):
        within(replace(model, torques=(spring,)), motion, [narrow])
    with pytest.raises(InputError, match="the temperature along the plan is not known"):
        within(replace(model, torques=(warm,)), motion, [motion])
    with pytest.raises(InputError, match="friction-warmup, and how long the machine will have run"):
        within(replace(model, torques=(cold,)), motion, [motion])


def test_a_motor_that_turns_with_several_joints_is_named_where_the_model_has_no_friction_of_it(rig):
    tx40 = Rig.load("tx40-simulated")
    names = [axis.joint for axis in tx40.axes]
    (remark,) = shared_motor_remarks(names, tx40.drive_gain, ())
    assert remark.startswith("j6: its motor turns with j5 too")
    assert "coupled-friction@j6" in remark
    assert shared_motor_remarks(names, tx40.drive_gain, {5}) == []
    assert shared_motor_remarks(["j3"], rig.drive_gain, ()) == []


@pytest.fixture(scope="module")
def wrist():
    """The TX40 with nothing but friction, one way at constant speeds: j6 turns against what j5 makes its motor turn."""
    tx40 = Rig.load("tx40-simulated")
    base = base_parameters(Geometry.from_robot(experiment_robot(tx40)))
    nothing = np.zeros(len(base))
    shares, carried = motor_shares(tx40.drive_gain), load_shares(tx40.drive_gain)
    model = ExportedModel(
        "friction", "wrist", base, nothing, base.nearest_standard(nothing), shares, carried, (), (), ()
    )
    time = np.arange(0.0, 1.0, 0.01)
    speeds = np.array([0.1, 0.1, 0.1, 0.1, 0.3, -2.0 * 0.3 * shares[4, 5]])
    speed = np.tile(speeds, (len(time), 1))
    motion = Motion(time, time[:, None] * speeds, speed, 0.0 * speed, None, tx40.payload("none"))
    return model, motion, speeds


def of_the_shared_motor(viscous, dry):
    """On the joints that the TX40's sixth motor turns."""
    formulas = of_motor(("dq", "direction", "ddq"), 0.0)
    return tuple(
        Torque("coupled-friction", row, 5, formulas, (viscous, dry, 0.01), rubs=True) for row in (4, 5)
    )


def of_a_joint(joint, viscous):
    return Torque("viscous", joint, joint, ("dq",), (viscous,), rubs=True)


def test_friction_of_a_motor_that_moves_two_joints_may_drive_one_of_them(wrist):
    """F_V w + F_C sign(w) over the motor's speed w takes F_V w² + F_C |w| of both joints together."""
    model, motion, speeds = wrist
    turn = float(speeds @ model.shares[:, 5])
    alone = replace(model, torques=of_the_shared_motor(2.0, 3.0))
    on_j5 = (planned_torque(alone, motion).beside * motion.dq)[:, 4]
    assert on_j5.max() < 0.0
    taken = 2.0 * turn**2 + 3.0 * abs(turn)
    assert friction_work(alone, motion) == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.0, taken], abs=1e-9 * taken)
    # beside friction of the joints themselves, which stays with each of them
    both = replace(model, torques=(*alone.torques, of_a_joint(4, 5.0), of_a_joint(1, 7.0)))
    joints = [0.0, 7.0 * speeds[1] ** 2, 0.0, 0.0, 5.0 * speeds[4] ** 2, taken]
    assert friction_work(both, motion) == pytest.approx(joints, abs=1e-9 * taken)


def test_friction_that_drives_is_seen_where_it_is_whatever_else_takes(wrist):
    model, motion, speeds = wrist
    turned = replace(model, torques=of_the_shared_motor(-2.0, -3.0))
    assert [power < 0.0 for power in friction_work(turned, motion)] == [False] * 5 + [True]
    # a hundred times of it in the motor that j5 shares hides nothing of j5's own
    hidden = replace(model, torques=(*of_the_shared_motor(200.0, 300.0), of_a_joint(4, -1.0)))
    power = friction_work(hidden, motion)
    assert power[4] == pytest.approx(-(speeds[4] ** 2), rel=1e-6)
    assert power[5] > 0.0


def test_what_gives_back_is_no_friction_however_far_a_plan_goes_from_where_it_began(wrist):
    """An offset and a spring, which this plan pays into and never gets back; of the wrong sign they are what drives it."""
    model, motion, _ = wrist
    stored = tuple(
        Torque(effect, joint, joint, (formula,), (-value,))
        for joint in range(6)
        for effect, formula, value in (
            ("offset", "1.0", 3.0),
            ("joint-spring", "q", 20.0),
            ("tilt", "sin(q)", 4.0),
        )
    )
    assert not np.any(friction_work(replace(model, torques=stored), motion))


def test_friction_that_drives_is_refused(rig, plan, experiment):
    """A record whose commands have the sign of their friction turned round."""
    loaded = load_experiment(experiment)
    usual = identify(loaded, "usual")
    fit = usual.fitted.fit
    chi = fit.chi.copy()
    for slot, columns in zip(usual.fitted.slots, usual.fitted.observation.slot_columns, strict=True):
        if slot.term.effect.name in ("viscous", "coulomb"):
            chi[columns] *= -1.0
    turned = replace(usual, fitted=replace(usual.fitted, fit=replace(fit, chi=chi)))
    with pytest.raises(InputError, match="would drive"):
        torque_ahead(turned, rig, plan, rig.payload(PAYLOAD), "whole", 0.6)


def test_the_gains_of_the_drive_are_told_from_its_recordings(rig, result):
    """Of its cascade: v = K_v (K_p e + q'_ref - q') + K_i ∫ (K_p e + q'_ref - q'), e = q_ref - q, per rad of the motor."""
    motions = [
        motion
        for entry in result.fitted.entries
        for motion in measured_motions(result.fitted.record, entry, ("qref1",))
    ]
    (gains,) = estimated_controllers(motions, ["j3"], rig.drive_gain).listed
    servo, ratio = rig.simulated["drives"][0]["servo"], rig.axes[0].gear_ratio
    proportional, integral = ratio * servo["velocity_gain"], ratio * servo["velocity_integral"]
    assert gains.position == pytest.approx(servo["position_gain"] * proportional + integral, rel=0.05)
    assert gains.integral == pytest.approx(servo["position_gain"] * integral, rel=0.05)
    assert gains.velocity == pytest.approx(proportional, rel=0.1)


def test_a_proof_whose_first_run_never_began_leaves_nothing(rig, plan, result, tmp_path):
    payload = rig.payload(PAYLOAD)
    ahead = torque_ahead(result, rig, plan, payload, "whole", 0.6)
    run = CompensationRun(
        Proof(next_folder(tmp_path), proof_settings(rig, "rx130l", rig.payload(PAYLOAD)), rig, plan, ahead)
    )
    with run.without() as session:
        assert session.check().ok
    assert next_folder(tmp_path).name == "01"
    run.forget_unless_driven()
    assert list(tmp_path.iterdir()) == []


def compensate(*arguments, answers=""):
    return subprocess.run(
        [sys.executable, "-m", "api", "compensate", RIG, *arguments],
        input=answers,
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_drive_that_takes_no_torque_refuses_before_the_first_run(rig, plan, result, tmp_path):
    """Else a plan would be driven, its payload mounted, for nothing."""
    assert rig.simulated is not None
    settings = {**rig.simulated["drives"][0], "oddities": {"fixed_pdos": True}}
    fixed = rig.model_copy(update={"simulated": {**rig.simulated, "drives": [settings]}})
    payload = fixed.payload(PAYLOAD)
    ahead = torque_ahead(result, fixed, plan, payload, "whole", 0.6)
    run = CompensationRun(
        Proof(tmp_path / "00", proof_settings(fixed, "rx130l", payload), fixed, plan, ahead), seed=3
    )
    with (
        run.without() as session,
        pytest.raises(StepOutOfTurn, match=r"torque offset 0x60B2 .* this drive does not take there"),
    ):
        session.check()
    run.forget_unless_driven()
    assert not run.proof.folder.exists()


def test_a_pair_whose_second_run_was_not_started_is_said_to_be_half_and_is_continued(experiment, rig):
    wanted = ["--payload", PAYLOAD, "--seconds", "18.1", "--part", "friction", "--mass", "3.4584", "--json"]
    half = compensate("--experiment", str(experiment), *wanted, answers="y\nn\n")
    assert (half.returncode, half.stdout.strip()) == (1, "")
    said = half.stderr.splitlines()[-1]
    assert "the pair is incomplete" in said
    number = re.search(r"--continue (\d+)$", said)[1]
    folder = experiment / "compensation" / number
    assert read_conclusion(folder) is None
    first = first_recording(folder)
    other = Proof.load(folder, rig.model_copy(update={"cycle": 0.004}))
    with pytest.raises(InputError, match="cycle changed since the run without"):
        other.sent(first)

    again = ["--experiment", str(experiment), "--continue", number, "--yes", "--json"]
    wrong = compensate(*again, "--payload", "none")
    assert (wrong.returncode, wrong.stderr.count("\n")) == (2, 1)
    done = compensate(*again)
    assert done.returncode == 0, done.stderr
    document = CompensationDocument.model_validate(json.loads(done.stdout))
    assert (document.part, document.folder) == ("friction", f"compensation/{number}")
    assert document.recording_without == first.name
    assert document.joints[0].rms_with < document.joints[0].rms_without
    complete = compensate(*again)
    assert (complete.returncode, complete.stderr.count("\n")) == (2, 1)
    assert "both runs are complete" in complete.stderr


def test_a_torque_that_is_not_a_number_is_not_sent(rig):
    torque = np.zeros((2000, 1))
    torque[700] = np.nan
    with pytest.raises(InputError, match=r"j3: the torque asked for 1\.4 s into the plan is not a number"):
        torque_offset(rig, torque, 0.6)
