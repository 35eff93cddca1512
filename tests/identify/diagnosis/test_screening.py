"""Joints that are judged in another process are judged alike."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

from identify.diagnosis.screening import Screening
from identify.estimation.fitting import fit_model
from identify.estimation.forked import forked, side_by_side
from identify.estimation.requested_model import open_record, requested_model
from identify.recording import load_experiment
from tests.identify.diagnosis.test_any_record import write


@pytest.fixture(scope="module")
def screening(tmp_path_factory) -> Screening:
    folder: Path = write(tmp_path_factory.mktemp("three"), "free", 3, 100.0, [6.0], False, seed=4)
    record = open_record(load_experiment(folder))
    return Screening.of(fit_model(record, requested_model(record, "rigid")))


def test_what_is_found_is_the_same_and_of_the_same_candidates(screening, monkeypatch):
    monkeypatch.setattr(threading, "active_count", lambda: 1)  # the test runner's own thread is idle
    least = [screening.least(joint) for joint in range(3)]
    found, added = screening.selection.search(set(), least)
    with forked(2), side_by_side(3):
        found_in_forks, added_in_forks = screening.selection.search(set(), least)
    assert added  # friction is missing in the rigid model
    assert [(id(candidate), variant) for candidate, variant in added_in_forks] == [
        (id(candidate), variant) for candidate, variant in added
    ]
    for own, other in zip(found, found_in_forks, strict=True):
        assert [id(f.candidate) for f in other] == [id(f.candidate) for f in own]
        assert [(f.p_value, f.gain, f.justified) for f in other] == [
            (f.p_value, f.gain, f.justified) for f in own
        ]


def test_each_process_makes_the_columns_of_its_joints_and_all_have_the_factors(screening, monkeypatch):
    monkeypatch.setattr(threading, "active_count", lambda: 1)
    alone = screening.selection.observation
    with forked(2), side_by_side(3):
        first, second = (Screening.of(screening.fitted).selection.observation for _ in range(2))
    for observation in (first, second):  # the second takes from what the first held
        for own, other in (
            (alone.slot_columns, observation.slot_columns),
            (alone.joint_columns, observation.joint_columns),
        ):
            assert [columns.tolist() for columns in own] == [columns.tolist() for columns in other]
        assert observation.blocks == alone.blocks
        for own, other in zip(alone.factors, observation.factors, strict=True):
            for mine, theirs in zip(own, other, strict=True):
                assert mine.rows == theirs.rows
                np.testing.assert_array_equal(mine.r, theirs.r)
