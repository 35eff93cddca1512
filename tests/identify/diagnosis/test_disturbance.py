"""What comes and goes without regard to the motion, in residuals made for the purpose: noise is left alone, disturbances
are found."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, sosfilt

from identify.diagnosis.deciding_constants import LEAST_SHARE
from identify.diagnosis.disturbance import least_remembered, remembered, strong_runs
from identify.diagnosis.structure import Structure, leftover_structure
from identify.diagnosis.verdict import verdict
from identify.estimation.prediction import Prediction
from identify.validation.noise_floor import NoiseFloor

Array = NDArray[np.float64]
Rest = Callable[[np.random.Generator, Array], Array]

STEP = 0.02
TORQUE = 10.0
RUNS = 200


def sessions(
    rest: Rest, seed: int, loudness: float, duration: float = 30.0, count: int = 3
) -> list[Prediction]:
    """Sessions of a joint that swings to and fro, with a rest that has `loudness` of the torque beside it."""
    random = np.random.default_rng(seed)
    parts = []
    for index in range(count):
        time = np.arange(0.0, duration, STEP)
        phase = 2 * np.pi * 0.23 * time + index
        left = rest(random, time)
        left *= loudness * TORQUE / np.sqrt(2) / np.sqrt(np.mean(left**2))
        predicted = TORQUE * np.cos(phase)
        parts.append(
            Prediction(
                file=f"session-{index:02d}.csv",
                joint="j1",
                time=time,
                position=np.sin(phase),
                velocity=np.cos(phase),
                acceleration=-np.sin(phase),
                load=predicted,
                measured=predicted + left,
                predicted=predicted,
                moving=np.abs(np.cos(phase)) > 0.01,
                temperature=None,
            )
        )
    return parts


def coloured(memory: float) -> Rest:
    """Noise with an exponential correlation, e^(-t / memory); white for 0."""

    def rest(random: np.random.Generator, time: Array) -> Array:
        forgotten = np.exp(-STEP / memory) if memory else 0.0
        return np.asarray(lfilter([1.0], [1.0, -forgotten], random.standard_normal(len(time) + 500)))[500:]

    return rest


def heavy(random: np.random.Generator, time: Array) -> Array:
    """Noise with four degrees of freedom, and ten times as strong for some seconds, as where a motor is cold."""
    level = np.exp(np.repeat(random.normal(0.0, 1.0, len(time) // 100 + 1), 100)[: len(time)])
    return np.asarray(level * random.standard_t(4, len(time)))


def wind(random: np.random.Generator, time: Array) -> Array:
    """0.15 to 1.5 Hz, in white noise."""
    band = butter(2, (0.15, 1.5), "band", fs=1 / STEP, output="sos")
    gusts = np.asarray(sosfilt(band, random.standard_normal(len(time) + 500)))[500:]
    return gusts / np.std(gusts) + 0.3 * random.standard_normal(len(time))


def bursts(random: np.random.Generator, time: Array) -> Array:
    """Four bursts of drag of a second or so, against the motion, in white noise."""
    left = 0.2 * random.standard_normal(len(time))
    for start in random.uniform(1.0, time[-1] - 3.0, 4):
        on = (time > start) & (time < start + random.uniform(0.8, 1.6))
        left[on] += np.sign(np.cos(2 * np.pi * 0.23 * time[on]))
    return left


def knocks(random: np.random.Generator, time: Array) -> Array:
    """Two half sines of 0.3 s in white noise."""
    left = 0.05 * random.standard_normal(len(time))
    # at the middle of a swing: what happens at a reversal is the friction's
    for swing in random.choice(np.arange(2, 12), 2, replace=False):
        at = (time - swing / 0.46 + 0.15) / 0.3
        left += np.where((at > 0) & (at < 1), np.sin(np.pi * np.clip(at, 0, 1)), 0.0)
    return left


def found(parts: list[Prediction], view: tuple[str, ...]) -> Structure:
    return next(each for each in leftover_structure(parts) if each.variables == view)


@pytest.mark.parametrize("rest", [coloured(0.0), coloured(0.05), coloured(0.1), coloured(0.2), heavy])
def test_noise_of_an_amplifier_is_called_a_disturbance_in_two_runs_of_a_hundred_at_most(rest):
    alarms = 0
    for seed in range(RUNS):
        parts = sessions(rest, seed, loudness=0.01)
        rests = (remembered(parts), remembered(parts, with_direction=True))
        alarms += any(
            each.share > least_remembered() and each.share > 3.117 * each.deviation for each in rests
        )
        alarms += strong_runs(parts).share > LEAST_SHARE
    assert alarms <= 0.02 * RUNS


def test_loud_noise_that_forgets_itself_in_a_tenth_of_a_second_is_noise_as_well():
    for seed in range(50):
        parts = sessions(coloured(0.1), seed, loudness=0.1)
        assert remembered(parts).share < 0.15
        assert strong_runs(parts).share < 0.01


def test_exponential_noise_is_foretold_by_the_closed_form_of_its_two_nearest_neighbours():
    # a Markov process between two known values, `lag` to either side: 2 r² / (1 + r²) of its variance, r = e^(-lag/memory)
    memory, lag = 1.0, 0.3
    parts = sessions(coloured(memory), 7, loudness=0.01, duration=200.0)
    r = np.exp(-lag / memory)
    assert remembered(parts).share == pytest.approx(2 * r**2 / (1 + r**2), abs=0.06)


@pytest.mark.parametrize(
    ("rest", "view"),
    [(wind, ("time",)), (bursts, ("time", "direction")), (knocks, ("moments",))],
)
def test_a_disturbance_is_found_and_the_joint_called_unexplained(rest, view):
    for seed in range(8):
        parts = sessions(rest, seed, loudness=0.1)
        structure = leftover_structure(parts)
        assert next(each for each in structure if each.variables == view).found
        assert verdict(0.1, 0.1, None, structure, missing=False) == "unexplained"
        # a floor from repeats counts the disturbance as noise, and does not hide it
        assert verdict(0.1, 0.1, NoiseFloor(0.1, 0.1, 0.1), structure, missing=False) == "unexplained"


def test_a_kink_at_every_reversal_is_no_disturbance():
    def turning_late(random: np.random.Generator, time: Array) -> Array:
        early = np.sign(np.cos(2 * np.pi * 0.23 * (time + 0.04)))
        return 0.05 * random.standard_normal(len(time)) + np.sign(np.cos(2 * np.pi * 0.23 * time)) - early

    assert strong_runs(sessions(turning_late, 3, loudness=0.02, count=1)).share == 0.0


def shaking(hertz: Callable[[Array], Array]) -> Rest:
    def rest(random: np.random.Generator, time: Array) -> Array:
        phase = 2 * np.pi * np.cumsum(hertz(time)) * STEP
        return np.sin(phase) + 0.3 * random.standard_normal(len(time))

    return rest


def test_a_line_is_one_only_where_its_frequency_stays():
    steady = sessions(shaking(lambda time: np.full(len(time), 6.0)), 1, loudness=0.05)
    stepping = sessions(shaking(lambda time: np.where(time < 15.0, 6.0, 14.0)), 1, loudness=0.05)
    assert found(steady, ("frequency",)).found
    assert not found(stepping, ("frequency",)).found


def test_what_is_remembered_must_be_a_tenth_more_than_what_is_known_of_noise_from_a_sample_before_and_one_after():
    """Least squares on the covariance of e^(-t/0.2 s) at 0.3 s."""
    near, far = np.exp(-0.3 / 0.2), np.exp(-0.6 / 0.2)
    between = np.array([near, near])
    explained = between @ np.linalg.solve(np.array([[1.0, far], [far, 1.0]]), between)
    assert least_remembered() == pytest.approx(0.1 + explained)
