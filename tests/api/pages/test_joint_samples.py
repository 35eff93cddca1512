"""One joint's samples: what follows of them, by hand, and which of them figures show."""

from dataclasses import fields, replace

import numpy as np
import pytest

from api.pages.joint_samples import JointSamples, every_few, gathered, relative_error
from api.service.stored_samples import COLUMNS, StoredSamples


@pytest.fixture
def samples() -> JointSamples:
    """Five samples of a first session, two of a second; the third is at rest."""
    columns = {
        field.name: np.zeros(7) for field in fields(JointSamples) if field.name not in ("files", "moving")
    } | {
        "session": np.array([0, 0, 0, 0, 0, 1, 1]),
        "position": np.array([0.5, 0.7, 0.8, 0.6, 0.1, -1.0, -1.5]),
        "velocity": np.array([2.0, 1.0, 0.0, -2.0, -3.0, -3.0, -1.0]),
        "measured": np.array([5.0, 4.0, 1.0, -3.0, -6.0, 2.0, -2.0]),
        "predicted": np.array([4.0, 4.5, 1.0, -5.0, -5.0, 1.0, -2.5]),
    }
    moving = np.array([True, True, False, True, True, True, True])
    return JointSamples(files=("a.csv", "b.csv"), moving=moving, **columns)


def test_the_error_is_what_is_measured_less_what_is_predicted(samples):
    assert samples.error.tolist() == [1.0, -0.5, 0.0, 2.0, -1.0, 1.0, 0.5]
    assert samples.speed.tolist() == [2.0, 1.0, 0.0, 2.0, 3.0, 3.0, 1.0]


def test_turned_by_the_direction_it_is_positive_where_more_is_lost_than_modelled(samples):
    assert samples.turned_error.tolist() == [1.0, -0.5, 0.0, -2.0, 1.0, -1.0, -0.5]


def test_the_travel_begins_at_each_reversal_and_each_session(samples):
    assert samples.travel == pytest.approx([0.0, 0.2, 0.0, 0.0, 0.5, 0.0, 0.5])
    assert samples.where(np.zeros(7, bool)).travel.tolist() == []


def test_what_is_in_the_fit_is_what_moves(samples):
    assert samples.in_fit.position.tolist() == [0.5, 0.7, 0.6, 0.1, -1.0, -1.5]
    assert samples.in_fit.files == ("a.csv", "b.csv")
    assert samples.in_fit.in_fit is samples.in_fit


@pytest.mark.parametrize(("most", "step"), [(6, 4), (10, 3), (11, 2)])
def test_thinned_parts_are_thinned_as_one(most, step):
    rows = every_few([10, 2, 0, 9], at_most=most)
    everything = np.arange(21)
    parts = np.split(everything, [10, 12, 12])
    kept = np.concatenate([part[each] for part, each in zip(parts, rows, strict=True)])
    assert kept.tolist() == everything[::step].tolist()


@pytest.mark.parametrize(("samples_", "step"), [(150_000, 1), (150_001, 2), (300_000, 2), (300_001, 3)])
def test_no_more_than_figures_show_are_left(samples_, step):
    (rows,) = every_few([samples_])
    assert rows == slice(0, samples_, step)
    assert len(range(*rows.indices(samples_))) <= 150_000


def test_sessions_are_gathered_one_after_the_other():
    parts = {
        file: StoredSamples(**{name: np.arange(size) + 10.0 * number for name in COLUMNS})
        for number, (file, size) in enumerate({"a.csv": 5, "b.csv": 4}.items())
    }
    parts["a.csv"] = replace(parts["a.csv"], moving=np.array([0.0, 1.0, 1.0, 0.0, 1.0]))
    joined = gathered(parts, [slice(0, 5, 2), slice(1, 4, 2)])
    assert joined.session.tolist() == [0, 0, 0, 1, 1]
    assert joined.position.tolist() == [0.0, 2.0, 4.0, 11.0, 13.0]
    assert joined.moving.tolist() == [False, True, True, True, True]


def test_a_relative_error_is_one_norm_over_the_other():
    assert relative_error(np.array([3.0, 4.0]), np.array([0.0, 1.0])) == pytest.approx(0.2)
    assert relative_error(np.zeros(2), np.ones(2)) is None
