"""The step of an encoder and its rounding, of positions that were rounded by a known step."""

import numpy as np
import pytest

from identify.signals.position_noise import position_rounding, position_step


def swing(step: float, samples: int = 4000) -> np.ndarray:
    smooth = np.sin(2 * np.pi * 0.3 * np.arange(samples) * 1e-3 + 0.1)
    return np.round(smooth / step) * step


@pytest.mark.parametrize("step", [1e-4, 3e-5])
def test_the_step_is_the_encoder_s_and_each_joint_has_its_own(step):
    found = position_step(np.column_stack([swing(step), 1000.0 + swing(4 * step)]))
    np.testing.assert_allclose(found, [step, 4 * step], rtol=1e-6)


def test_rounding_of_floats_is_no_step_and_a_joint_at_rest_has_none():
    still = np.full(100, 123.4)
    still[1::2] += 1e-11
    assert np.isinf(position_step(still[:, None]))[0]


@pytest.mark.parametrize("step", [1e-3, 1e-4])
def test_the_scatter_of_third_differences_gives_the_step_that_rounded(step):
    # independent errors of uniform rounding: variance step²/12, twenty times that in third differences
    noisy = np.random.default_rng(3).uniform(-step / 2, step / 2, (20_000, 1))
    assert position_rounding(noisy)[0] == pytest.approx(step * np.sqrt(12 / 20) * np.sqrt(20 / 12), rel=0.02)
    smooth = np.sin(2 * np.pi * 0.3 * np.arange(4000) * 1e-3)[:, None]
    assert position_rounding(smooth)[0] < 1e-7


def test_eight_positions_are_the_fewest_that_say_something():
    ramp = np.arange(8.0)[:, None] ** 2
    assert np.isinf(position_rounding(ramp[:7])).all()
    assert np.isfinite(position_rounding(ramp)).all()
