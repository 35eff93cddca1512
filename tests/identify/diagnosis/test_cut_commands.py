"""Commands that are cut at a limit hide no effect and are none: plants whose record is cut at a part of its largest command."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.diagnosis.diagnosis import diagnose
from identify.estimation.doubts import cut_commands
from identify.identification import identify
from identify.recording import load_experiment
from tests.plants.closed_loop import LoopArm, simulate, write_arm
from tests.plants.single_joint import record, write_experiment


def cut_at(folder, effects, part):
    made = record(effects, seed=3, duration=30.0, rate=250.0)
    top = part * max(float(np.abs(columns["v1"]).max()) for columns in made.sessions)
    sessions = tuple(columns | {"v1": np.clip(columns["v1"], -top, top)} for columns in made.sessions)
    count = sum(int((np.abs(columns["v1"]) == top).sum()) for columns in sessions)
    return load_experiment(write_experiment(folder, replace(made, sessions=sessions))), top, count


@pytest.mark.parametrize(
    ("effects", "part", "missing"),
    [
        ({}, 0.6, []),
        ({}, 0.9, []),
        ({"stribeck": 1.0}, 0.6, ["stribeck"]),
        ({"load-friction": 1.0}, 0.75, ["load-friction"]),
    ],
)
def test_what_is_hidden_is_named_and_nothing_else(tmp_path, effects, part, missing):
    experiment, top, count = cut_at(tmp_path / "cut", effects, part)
    document = diagnose(experiment).document()
    assert list(document.joints[0].missing) == missing
    assert document.joints[0].verdict == ("missing" if missing else "adequate")
    (remark,) = document.remarks
    assert f"{top:.5g}" in remark
    assert f" {count} samples" in remark
    assert remark in identify(experiment).document().remarks


def test_nothing_is_said_of_a_record_that_was_not_cut(tmp_path):
    experiment, *_ = cut_at(tmp_path / "whole", {}, 2.0)
    assert cut_commands(identify(experiment).fitted.record) == []


@pytest.mark.parametrize(("hidden", "missing"), [({}, []), ({"stiction": 8.0}, ["stribeck"])])
def test_a_motor_that_gives_less_at_its_limit_is_not_taken_for_an_effect(tmp_path, hidden, missing):
    """In closed loop, with the amplifier saturated at four fifths of what the controller would ask for."""
    arm = LoopArm(
        amplitude=0.02,
        first_moment=1.0,
        payloads=(0.0, 1.0),
        seed=5,
        limit=51.0,
        given_at_limit=0.9,
        **hidden,
    )
    (sessions,) = simulate([arm])
    diagnosed = diagnose(load_experiment(write_arm(tmp_path / "loop", arm, sessions))).document()
    assert list(diagnosed.joints[0].missing) == missing
    assert len(diagnosed.remarks) == 1
