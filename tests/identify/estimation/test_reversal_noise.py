"""How much less a sample around a reversal counts, worked out by hand for one that is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
import pytest

from identify.estimation.reversal_noise import LATEST, ReversalNoise
from identify.signals import MotionBlock
from identify.signals.reversals import Reversals

PERIOD = 0.002  # s


@dataclass(frozen=True)
class Block:
    """What the weights read of a block of motion; every row is kept, so that a weight stands at its own row."""

    direction: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    reversals: tuple[Reversals, ...]
    sampling_period: float = PERIOD

    def decimate(self, values: np.ndarray) -> np.ndarray:
        return values


def weights(heading, acceleration, reversals, dry, deviation=0.5, speed=0.0) -> np.ndarray:
    rows = np.asarray(heading, float)[:, None]
    block = Block(rows, 0.1 * rows, np.full(rows.shape, acceleration), (reversals,))
    noise = ReversalNoise(np.array([deviation]), np.array([speed]))
    return noise.weights(cast(MotionBlock, block), 0, np.asarray(dry, float))


def none() -> Reversals:
    return Reversals(np.zeros(0), np.zeros(0), np.zeros(0), np.zeros(0))


def weight_of(step: float, late: float, deviation: float = 0.5) -> float:
    """By hand: a step in N m that comes `late` s too late, over one sample, beside a deviation in N m."""
    return 1.0 / np.sqrt(1.0 + (step * late / PERIOD / deviation) ** 2)


HEADING = [1, 1, 1, 1, -1, -1, -1, -1]
DRY = [3, 3, 3, 3, -3, -3, -3, -3]


def test_a_reversal_known_to_a_sample_counts_less_at_its_row_alone():
    weighted = weights(HEADING, -2.0, none(), DRY)
    expected = np.ones(8)
    expected[4] = weight_of(6.0, PERIOD / np.sqrt(12))
    np.testing.assert_allclose(weighted, expected)


def test_a_stop_between_is_passed_over_and_the_turn_is_where_it_goes_on():
    heading = [1, 1, 1, 0, 0, -1, -1, 1]
    weighted = weights(heading, 2.0, none(), [3, 3, 3, 0, 0, -3, -3, 3])
    assert np.flatnonzero(weighted < 1.0).tolist() == [5, 7]
    assert (weights([1, 1, 0, 0, 1, 1], 2.0, none(), [3, 3, 0, 0, 3, 3]) == 1.0).all(), "it goes on as before"


@pytest.mark.parametrize("acceleration", [2.0, -2.0, 0.0])
def test_a_speed_that_is_not_known_makes_the_instant_late_by_the_acceleration(acceleration):
    late = np.hypot(PERIOD / np.sqrt(12), 0.01 / abs(acceleration)) if acceleration else LATEST
    weighted = weights(HEADING, acceleration, none(), DRY, speed=0.01)
    assert weighted[4] == pytest.approx(weight_of(6.0, late))


def test_what_the_positions_say_of_the_instant_widens_it_and_where_the_step_is_looked_for():
    instants = Reversals(np.array([3.4]), np.array([3.6]), np.array([1.2]), np.array([-1.0]))
    dry = [3, 3, 2, 1, -1, -2, -3, -3]  # passes over within three rows
    weighted = weights(HEADING, -2.0, instants, dry)
    around = 1 + int(np.ceil(np.sqrt(3.0) * 1.2))
    step = abs(dry[min(4 + around, 7)] - dry[4 - around])
    late = np.hypot(PERIOD / np.sqrt(12), 1.2 * PERIOD)
    assert weighted[4] == pytest.approx(weight_of(step, late))
    assert (np.delete(weighted, 4) == 1.0).all()
