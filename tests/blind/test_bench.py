"""The blind bench itself: its record goes on where it was broken off, its figures are what they say."""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np
import pytest

from daq.rig import Rig
from identify.recording import load_experiment
from identify.recording.errors import InputError
from identify.results.diagnosis import DiagnosisDocument, JointDiagnosis
from identify.results.next_experiment import Proposal
from tests.blind import plasmodes
from tests.blind.__main__ import part_of, recorded, run
from tests.blind.arms import ArmCase
from tests.blind.cases import hides_nothing, made_by_sampling
from tests.blind.loops import LoopCase, draw_loop, with_effects
from tests.blind.noise import FloorScore, floor_score
from tests.blind.plasmodes import present, with_effect
from tests.blind.proposals import Told, motion_of, table
from tests.blind.report import page, reliability, wilson
from tests.blind.rigs import CATALOGUED, RIG
from tests.blind.score import Score, scored
from tests.plants.closed_loop import LoopArm, simulate
from tests.plants.planar_arm import draw_planar_arm
from tests.plants.single_joint import record, write_experiment


def score(index, right=True, **changed):
    facts = {
        "plant": "joint",
        "seed": 5,
        "index": index,
        "kind": "weak",
        "hidden": "stribeck × 0.3",
        "names": ("stribeck",),
        "verdict": "missing",
        "missing": ("stribeck",) if right else ("presliding",),
        "right": right,
        "beside": (),
        "seconds": 1.5,
        "statements": ((0.9, right), (0.04, False)),
        **changed,
    }
    return Score(**facts)


def test_a_record_holds_scores_as_they_are_and_leaves_out_a_line_that_was_cut_off(tmp_path):
    floor = FloorScore(0.02, 0.019, 0.022, 0.021, 0.03, repeats=True)
    scores = [score(0, elsewhere=("j1:delay",), floor=floor), score(1, right=False, learned="q: table")]
    file, other = tmp_path / "one.jsonl", tmp_path / "other.jsonl"
    file.write_text("".join(f"{each.line()}\n" for each in scores) + scores[0].line()[:40], encoding="utf-8")
    assert recorded([file]) == scores
    other.write_text(f"{score(1).line()}\n{score(2).line()}\n", encoding="utf-8")
    assert recorded([file, other]) == [*scores, score(2)]  # of one case the first
    file.write_text("{}\n", encoding="utf-8")
    with pytest.raises(InputError, match="line 1"):
        recorded([file])


def test_what_a_record_has_is_not_run_again(tmp_path):
    file = tmp_path / "record.jsonl"
    file.write_text(f"{score(0).line()}\n{score(1).line()}\n", encoding="utf-8")
    options = argparse.Namespace(
        record=file,
        cases=2,
        loops=0,
        rigs=0,
        arms=0,
        plasmodes=0,
        seed=5,
        part=(1, 1),
        cluster=None,
        workers=1,
    )
    assert run(options) == [score(0), score(1)]


@pytest.mark.parametrize("text", ["0/3", "4/3", "a/b", "3", "-1/2"])
def test_a_part_that_is_none_is_refused(text):
    with pytest.raises(argparse.ArgumentTypeError):
        part_of(text)


def test_probabilities_that_are_right_as_often_as_they_say_have_no_calibration_error():
    right = [(0.9, True)] * 90 + [(0.9, False)] * 10 + [(0.3, True)] * 30 + [(0.3, False)] * 70
    rows, error = reliability(right)
    assert error == pytest.approx(0.0, abs=1e-12)
    assert [(count, part) for _, _, count, _, part in rows] == [(100, 0.3), (100, 0.9)]
    _, error = reliability([(1.0, False)] * 5 + [(1.0, True)] * 15)
    assert error == pytest.approx(0.25)


def test_the_interval_of_a_part_is_wilsons():
    assert wilson(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)  # published table values
    assert wilson(5, 10) == pytest.approx((0.2366, 0.7634), abs=1e-4)


def test_the_page_tells_classes_reliability_and_what_went_wrong():
    text = page([score(0), score(1, right=False)])
    assert "| weak | 2 | 1 | 50 % |" in text
    assert "## Reliability" in text
    assert "| weak | stribeck × 0.3 | missing: presliding | 5, 1 |" in text


def test_a_loop_case_is_drawn_alike_again_and_hides_what_it_says():
    case = draw_loop(3, 0)
    assert case == draw_loop(3, 0) != draw_loop(4, 0)
    assert isinstance(case, LoopCase)
    assert (case.kind, case.names) == ("loop null", ())


def test_no_hidden_delay_is_what_a_held_command_makes():
    """Half of the rig's cycle; at the test joint of 250 Hz half of 4 ms."""
    random = np.random.default_rng(4)
    cycle = Rig.load(RIG).cycle
    assert not any(made_by_sampling(CATALOGUED["delay"](random)["seconds"], cycle) for _ in range(30))
    assert hides_nothing({"delay": 0.35, "stribeck": 1.0}, 250.0)
    assert not hides_nothing({"delay": 0.35}, 500.0)
    assert not hides_nothing({"stribeck": 0.35}, 250.0)


def test_every_effect_of_the_loops_changes_the_motion_or_the_command():
    plain = LoopArm(duration=2.0, payloads=(3.0,), amplitude=0.0, motion="fourier", seed=8)
    hiding = [{"delay": 0.01}, {"stribeck": 8.0}, {"viscous-quadratic": 9.0}, {"joint-spring": 20.0}]
    hiding += [{"load-friction": 0.2}, {"bumper": 80.0}]
    (reference,), *others = simulate([plain, *(with_effects(plain, each) for each in hiding)])
    for ((_, _, command),) in others:
        assert np.abs(command - reference[2]).max() > 0.01 * np.abs(reference[2]).max()


def test_a_plasmode_changes_the_command_by_the_effect_and_nothing_else(tmp_path, monkeypatch):
    monkeypatch.setenv("COULOMB_MEASURED_DATA", str(tmp_path))
    made = record({}, payload_masses=(0.0, 3.0), duration=4.0, rate=250.0, repeats=1, seed=2)
    write_experiment(tmp_path / "emps", made)
    assert present() == ("emps",)
    folder = with_effect("emps", 0, "joint-spring", 2.0, 0.25, tmp_path / "with")
    before, after = (load_experiment(each) for each in (tmp_path / "emps", folder))
    pairs = [(before.read(a), after.read(b)) for a, b in zip(before.sessions, after.sessions, strict=True)]
    places = np.concatenate([old.position for old, _ in pairs])
    torque = np.concatenate([(new.command - old.command) * made.joint.drive_gain for old, new in pairs])
    shape = (places - places.min()) / np.ptp(places) - 0.25
    np.testing.assert_allclose(torque, 2.0 * shape / np.sqrt(np.mean(shape**2)), atol=1e-9)
    for old, new in pairs:
        np.testing.assert_array_equal(old.position, new.position)
        np.testing.assert_array_equal(old.time, new.time)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("name", ["friction-position", "viscous-asymmetric"])
def test_friction_that_is_put_into_a_record_never_drives_the_joint(tmp_path, monkeypatch, name, sign):
    monkeypatch.setenv("COULOMB_MEASURED_DATA", str(tmp_path))
    made = record({}, payload_masses=(0.0,), duration=4.0, rate=250.0, repeats=1, seed=2)
    write_experiment(tmp_path / "emps", made)
    folder = with_effect("emps", 0, name, sign * 2.0, 0.25, tmp_path / "with")
    before, after = (load_experiment(each) for each in (tmp_path / "emps", folder))
    (old,), (new,) = ([each.read(entry) for entry in each.sessions] for each in (before, after))
    torque = (new.command - old.command)[:, 0] * made.joint.drive_gain
    power = torque * np.gradient(old.position[:, 0], old.time)
    assert -power[power < 0].sum() < 0.01 * power.sum()
    assert np.abs(torque).max() > 2.0


def strength_of(monkeypatch, alike, left_by_own):
    """Of a weak plasmode: the usual model leaves 0.8 of the effect, what the machine has of its own a part of that."""
    own = np.array([3.0, 0.0])
    effect = 0.8 * np.array([alike, np.sqrt(1 - alike**2)])  # what the model leaves of one newton metre
    monkeypatch.setattr(plasmodes, "with_effect", lambda *case: case[3])
    monkeypatch.setattr(plasmodes, "_own_effects", lambda _record: ("viscous-power@j1",))

    def left(folder, _joint, add=()):
        strength = folder if isinstance(folder, float) else 0.0
        return float(np.linalg.norm(own + strength * (left_by_own if add else 1.0) * effect)), 10.0

    monkeypatch.setattr(plasmodes, "_left", left)
    case = plasmodes.PlasmodeCase("plasmode weak", 1, "emps", 0, {"joint-spring": 1.0}, 0.5)
    return plasmodes._scaled(case, 0.6)


@pytest.mark.parametrize("alike", [-0.4, 0.0, 0.4])
def test_the_strength_of_a_plasmode_is_what_its_effect_leaves_whatever_the_machine_has_of_its_own(
    monkeypatch, alike
):
    assert strength_of(monkeypatch, alike, left_by_own=0.5) == pytest.approx(0.6 * 3.0 / 0.8)


def test_nothing_is_hidden_that_the_effects_of_the_machine_take_up(monkeypatch):
    assert strength_of(monkeypatch, 0.4, left_by_own=0.05) is None


def arm_case(effects):
    arm = draw_planar_arm(np.random.default_rng(1), 2)
    return ArmCase(
        "arm strong" if effects else "arm null", 1, arm, 1, effects, (0.0, 2.0), 250.0, 1, 1.0, 1.0
    )


def said_of(*missing):
    """A diagnosis that names these effects, joint by joint."""
    joints = tuple(
        JointDiagnosis(
            joint=f"j{place + 1}",
            verdict="missing" if names else "adequate",
            missing=names,
            candidates=(),
            evidence=(),
            where=(),
            noise_floor=None,
            structure=(),
            superfluous=(),
        )
        for place, names in enumerate(missing)
    )
    return DiagnosisDocument.model_construct(joints=joints)


def test_what_is_named_at_a_joint_that_hides_nothing_is_counted():
    hiding = arm_case({"stribeck": 1.0})
    right = scored(hiding, said_of((), ("stribeck",)), 0.0, "arm", 5, 0)
    assert (right.right, right.elsewhere) == (True, ())
    both = scored(hiding, said_of(("delay",), ("stribeck",)), 0.0, "arm", 5, 1)
    assert (both.right, both.elsewhere) == (True, ("j1:delay",))
    other = scored(hiding, said_of(("stribeck",), ()), 0.0, "arm", 5, 2)
    assert (other.right, other.elsewhere) == (False, ("j1:stribeck",))
    null = scored(arm_case({}), said_of((), ("delay",)), 0.0, "arm", 5, 3)
    assert (null.right, null.elsewhere) == (False, ("j2:delay",))
    text = page([right, both, other, null])
    assert "| arm strong | 3 | 2 | 67 % |" in text
    assert "A wrong joint is blamed in 3 of 4 cases" in text
    assert "- stribeck × 1 at joint 2 of 2 (planar arm, 250 Hz, 1 repeats): j1:delay (5, 1)" in text


def test_floors_are_counted_by_whether_they_are_near_and_hold_and_lie_below_the_error():
    near = FloorScore(0.022, 0.020, 0.024, 0.021, 0.03, repeats=True)
    far = FloorScore(0.040, 0.035, 0.045, 0.021, 0.03, repeats=True)
    none = FloorScore(None, None, None, 0.021, 0.03, repeats=False)
    text = page([score(0, floor=near), score(1, floor=far), score(2, floor=none), score(3)])
    assert "| joint | repeats | 2 | 0 | 2 | 1 | 1 | 1 |" in text
    assert "| joint | does not repeat | 1 | 1 | 0 | 0 | 0 | 0 |" in text


def test_the_truth_of_a_floor_is_the_noise_that_was_simulated(tmp_path):
    """Twice the disturbance is twice the truth, and a drive's own noise counts."""
    quiet = LoopArm(duration=3.0, payloads=(3.0,), amplitude=0.02, period=1.0, seed=8)
    truths = []
    for place, arm in enumerate((quiet, replace(quiet, amplitude=0.04))):
        case = LoopCase("loop null", 1, {}, arm)
        folder = case.experiment(tmp_path / str(place))
        (joint,) = said_of(()).joints
        found = floor_score(case, joint, folder)
        assert found is not None
        assert found.repeats
        truths.append(found.truth)
    assert truths[1] == pytest.approx(2 * truths[0], rel=0.02)


@pytest.mark.parametrize("shape", ["sinusoid", "trapezoid"])
def test_the_plant_moves_as_is_proposed(shape):
    proposal = Proposal(
        payload="m0",
        shape=shape,
        speed=0.6,
        position_from=-0.5,
        position_to=0.7,
        repeats=2,
        separation=3.0,
        decides=False,
    )
    time, position, velocity, acceleration = motion_of(proposal)
    assert (position.min(), position.max()) == pytest.approx((-0.5, 0.7), abs=0.03)
    assert np.abs(velocity).max() == pytest.approx(0.6, abs=0.01)
    np.testing.assert_allclose(np.gradient(position, time)[5:-5], velocity[5:-5], atol=2e-3)
    np.testing.assert_allclose(np.gradient(velocity, time)[5:-5], acceleration[5:-5], atol=0.1)
    assert np.sum((velocity[1:] > 0.3) & (velocity[:-1] <= 0.3)) == 2


def test_what_next_expects_is_told_beside_what_came_of_it():
    sure = Told(5, 2, "delay", "backlash", 0.6, 0.7, 1.0, 1.0, decides=True, decided=True)
    wrong = replace(sure, told=0.0, decided=False)
    even = replace(sure, expected=0.5, told=0.5, decides=False)
    silent = replace(sure, told=0.5, decided=False, said=False)
    text = table([sure, wrong, even, even, silent])
    assert "| 0.95 to 1 | 2 | 1.00 | 0.50 |" in text
    assert "Calibration error 0.250 over 4 proposals; after 1 neither is said." in text
    assert "1 of 3 that were to decide did." in text
