"""The noise floor against what the plant's noise is: on a joint that has nothing but the usual model, the fit's error."""

import pytest

from identify import identify, load_experiment
from tests.plants.single_joint import record, write_experiment


def identified(folder, effects, **motion):
    recorded = record(effects, payload_masses=(0.0, 3.0), duration=30.0, **motion)
    return identify(load_experiment(write_experiment(folder, recorded)), "usual").document()


@pytest.mark.parametrize(
    ("seed", "rate", "repeats", "pace"),
    [(1, 500.0, 3, 1.0), (2, 250.0, 2, 0.77), (3, 1000.0, 3, 0.7), (4, 500.0, 2, 1.53)],
)
def test_where_nothing_is_missing_the_floor_is_the_error(tmp_path, seed, rate, repeats, pace):
    """Whatever part of a sample the period ends at: `pace` makes it end between two."""
    found = identified(tmp_path / "joint", {}, seed=seed, rate=rate, repeats=repeats, pace=pace)
    assert found.joints[0].noise_floor == pytest.approx(found.relative_error, rel=0.12)


def test_a_missing_effect_raises_the_error_and_not_the_floor(tmp_path):
    plain = identified(tmp_path / "plain", {}, seed=5, repeats=3).joints[0]
    hidden = identified(tmp_path / "hidden", {"stribeck": 1.0}, seed=5, repeats=3).joints[0]
    assert hidden.relative_error > 3 * plain.relative_error
    assert hidden.noise_floor == pytest.approx(plain.noise_floor, rel=0.05)


@pytest.mark.parametrize("seed", range(6))
def test_slow_ways_there_and_back_are_no_repeats(tmp_path, seed):
    found = identified(tmp_path / "joint", {}, seed=seed, rate=250.0, repeats=1, pace=0.8)
    floor = found.joints[0].noise_floor
    assert floor is None or floor == pytest.approx(found.relative_error, rel=0.2)
