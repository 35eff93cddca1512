"""Lines over position, against least squares at every wave number and against ripples of known wave number."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from identify.estimation.position_lines import _bands, _explained, position_lines

CUTOFF = 5.0  # Hz


def by_least_squares(q, values, weight, wave_numbers):
    found = []
    for k in wave_numbers:
        columns = np.column_stack([weight * np.cos(k * q), weight * np.sin(k * q)])
        solved = np.linalg.lstsq(columns, values, rcond=None)[0]
        found.append(1 - np.sum((values - columns @ solved) ** 2) / np.sum(values**2))
    return np.array(found)


def test_what_a_line_explains_is_what_least_squares_explains():
    random = np.random.default_rng(4)
    q = random.uniform(-0.7, 1.1, 400)
    weight = 20 * np.cos(q) + 3
    values = weight * 0.03 * np.sin(31 * q + 1) + 0.2 * random.standard_normal(400)
    wave_numbers, explained = _explained(q, values, weight, 60.0)
    some = slice(40, None, 7)
    # Positions are put in bins of an eighth of the shortest wave.
    assert explained[some] == pytest.approx(by_least_squares(q, values, weight, wave_numbers[some]), abs=0.03)


def seen(amplitude: float, wave_number: float, seed: int) -> tuple[Any, Any]:
    """A joint that is slow on two short ways only; faster than the filter's cut-off a ripple does not come through."""
    random = np.random.default_rng(seed)
    ways = [(0.0, 0.03, 120), (0.5, 0.02, 120), (-1.4, 0.9, 500)]  # from, rad/s, samples of 66 ms
    q = np.concatenate([start + speed * 0.066 * np.arange(count) % 2.9 for start, speed, count in ways])
    speed = np.concatenate([np.full(count, speed) for _, speed, count in ways])
    torque = 200 * np.cos(q) + 20
    passed = wave_number * speed < 2 * np.pi * CUTOFF
    residual = torque * amplitude * np.sin(wave_number * q + 0.6) * passed
    residual += 0.3 * random.standard_normal(len(q))
    part = SimpleNamespace(
        position=q, velocity=speed, residual=residual, predicted=torque, moving=np.ones(len(q), bool)
    )
    summary = SimpleNamespace(
        speed_quantiles=np.quantile(speed, [0.01, 0.02, 0.05]),
        speed_resolution=0.001,
        position_resolution=1e-6,
    )
    return part, summary


@pytest.mark.parametrize("wave_number", [95.0, 190.0, 285.0])
def test_a_ripple_that_only_short_slow_ways_show_is_found(wave_number):
    part, summary = seen(0.02, wave_number, seed=1)
    found = position_lines([part], summary, CUTOFF)
    width = 2 * np.pi / 0.25  # of a line over the slow ways
    assert found.gain
    assert abs(found.gain[0] - wave_number) < 0.3 * width


def test_both_ripples_are_tried_as_near_to_the_wave_number_as_the_whole_range_can_tell():
    """The slow ways here tell it to 25 per rad, the whole range to 2."""
    part, summary = seen(0.02, 95.0, seed=1)
    found = position_lines([part], summary, CUTOFF)
    cell = 2 * np.pi / float(np.ptp(part.position))
    for lines in (found.torque, found.gain):
        assert min(abs(np.array(lines) - 95.0)) < 0.6 * cell
        assert np.diff(np.sort(lines)).min() >= 0.5 * cell - 1e-9


@pytest.mark.parametrize(("cycles", "told"), [(2.0, False), (3.0, True)])
def test_a_ripple_of_three_cycles_over_the_range_is_told_from_a_slow_dependence_and_one_of_two_is_not(
    cycles, told
):
    random = np.random.default_rng(9)
    q = np.linspace(-1.2, 1.7, 900)
    wave_number = 2 * np.pi * cycles / float(np.ptp(q))
    part: Any = SimpleNamespace(
        position=q,
        velocity=np.full(len(q), 0.3),
        residual=3.0 * np.sin(wave_number * q + 0.4) + 0.1 * random.standard_normal(len(q)),
        predicted=200 * np.cos(q) + 20,
        moving=np.ones(len(q), bool),
    )
    summary: Any = SimpleNamespace(
        speed_quantiles=np.array([0.3, 0.3, 0.3]), speed_resolution=0.001, position_resolution=1e-6
    )
    lines = np.array([*position_lines([part], summary, CUTOFF).torque])
    assert bool(len(lines) and abs(lines - wave_number).min() < 0.3 * 2 * np.pi / float(np.ptp(q))) is told


@pytest.mark.parametrize("cycles", [6, 8, 11])
def test_a_ripple_shows_as_far_as_the_filter_lets_it_through(cycles):
    """Four seconds of a quick joint: few of 160 samples are slow enough for all of the ripple to pass."""
    rate, period = 1000.0, 25
    time = np.arange(0.0, 4.0, 1 / rate)
    q = 1.4 * np.sin(1.2 * time) * np.cos(0.55 * time)
    wave_number = 2 * np.pi * cycles / float(np.ptp(q))
    low_pass = butter(4, CUTOFF / (rate / 2), output="sos")
    ripple = sosfiltfilt(low_pass, np.sin(wave_number * q + 0.6))[::period]
    noise = 0.2 * np.random.default_rng(3).standard_normal(len(ripple))
    velocity = np.gradient(q, 1 / rate)[::period]
    part: Any = SimpleNamespace(
        position=q[::period],
        velocity=velocity,
        residual=ripple + noise,
        predicted=20 * np.cos(q[::period]),
        moving=np.ones(len(ripple), bool),
    )
    summary: Any = SimpleNamespace(
        speed_quantiles=np.quantile(np.abs(velocity), [0.01, 0.02, 0.05]),
        speed_resolution=0.001,
        position_resolution=1e-6,
    )
    lines = np.array([*position_lines([part], summary, CUTOFF).torque])
    assert len(lines)
    assert abs(lines - wave_number).min() < 0.5 * 2 * np.pi / float(np.ptp(q))


def test_what_noise_shows_is_weak_beside_a_ripple():
    """A line is only a candidate; of what noise shows, the held-out motion and the number of lines tried decide."""
    part, _ = seen(0.0, 95.0, seed=3)
    _, explained = _explained(part.position, part.residual, part.predicted, 95.0)
    part, _ = seen(0.02, 95.0, seed=3)
    slow = part.velocity < 0.1
    _, with_ripple = _explained(part.position[slow], part.residual[slow], part.predicted[slow], 95.0)
    assert explained.max() < 0.1 < 0.8 < with_ripple.max()


@pytest.mark.parametrize(
    ("lowest", "highest", "bands"),
    [
        (1.0, 10.0, [(1.0, 2.0), (2.0, 4.0), (4.0, 8.0), (8.0, 10.0)]),
        (3.0, 6.0, [(3.0, 6.0)]),
        (5.0, 5.0, []),
    ],
)
def test_wave_numbers_are_looked_at_in_octaves_the_last_cut_short(lowest, highest, bands):
    assert _bands(lowest, highest) == bands
