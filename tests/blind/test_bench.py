"""The blind bench itself: its record goes on where it was broken off, its figures are what they say."""

from __future__ import annotations

import argparse

import numpy as np
import pytest

from identify.recording import load_experiment
from identify.recording.errors import InputError
from tests.blind.__main__ import part_of, recorded, run
from tests.blind.loops import LoopCase, draw_loop, with_effects
from tests.blind.plasmodes import present, with_effect
from tests.blind.report import page, reliability, wilson
from tests.blind.score import Score
from tests.plants.closed_loop import LoopArm, simulate
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
    scores = [score(0), score(1, right=False, learned="q: table")]
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
        record=file, cases=2, loops=0, rigs=0, plasmodes=0, seed=5, part=(1, 1), cluster=None, workers=1
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
