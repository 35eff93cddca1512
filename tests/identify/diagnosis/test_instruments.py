"""Positions that disturbances do not reach: another repeat of the same motion, the reference, or the band of the motion."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from identify.diagnosis.deciding_constants import BAND, MOST
from identify.diagnosis.instruments import (
    BELOW_THE_FILTER,
    Instruments,
    _covers,
    motion_band,
)

PERIOD, STEP = 2.0, 0.01
TIME = np.arange(0, 9, STEP)


def session(position, file="a", segments=None, **extra):
    return SimpleNamespace(
        entry=SimpleNamespace(file=file),
        time=TIME[: len(position)],
        position=position,
        n=position.shape[1],
        segments=segments or [slice(0, len(position))],
        sampling_period=STEP,
        extra=extra,
    )


def repeating(seed=1):
    """Two joints that repeat their motion every 2 s, with another disturbance in every repeat."""
    phase = 2 * np.pi * TIME[:, None] / PERIOD
    noise = np.random.default_rng(seed).normal(scale=0.01, size=(len(TIME), 2))
    return np.hstack([np.sin(phase), np.cos(2 * phase)]) + noise


def test_a_sample_of_a_repeat_gets_the_position_of_the_next_repeat_and_one_of_the_last_that_of_the_repeat_before():
    measured = repeating()
    made = Instruments((5.0, 5.0), {"a": (1.0, 7.0, PERIOD)}, reference=False)(session(measured))
    there, whole = round(1.0 / STEP), round(PERIOD / STEP)
    stop = round(7.0 / STEP)
    np.testing.assert_allclose(made[there : stop - whole], measured[there + whole : stop], atol=1e-12)
    np.testing.assert_allclose(
        made[stop - whole + 1 : stop], measured[stop - 2 * whole + 1 : stop - whole], atol=1e-12
    )


def test_the_disturbance_of_a_sample_is_not_in_its_instrument():
    clean = repeating() - repeating()  # zeros of the shape
    disturbed = clean.copy()
    disturbed[350, 0] = 1.0
    made = Instruments((5.0, 5.0), {"a": (1.0, 7.0, PERIOD)}, reference=False)(session(disturbed))
    assert made[350, 0] == pytest.approx(0.0, abs=1e-12)
    assert made[350 - 200, 0] == pytest.approx(1.0)


def test_the_reference_serves_where_it_was_recorded_and_sessions_do_not_repeat():
    measured, planned = repeating(), repeating(2)
    given = session(measured, qref1=planned[:, 0], qref2=planned[:, 1])
    made = Instruments((5.0, 5.0), {"other": (1.0, 7.0, PERIOD)}, reference=True)(given)
    np.testing.assert_array_equal(made, planned)


def test_elsewhere_the_positions_are_low_passed_each_segment_by_itself():
    slow = np.sin(2 * np.pi * 0.5 * TIME)
    fast = 0.1 * np.sin(2 * np.pi * 20.0 * TIME)
    position = np.column_stack([slow + fast, slow])
    position[450:] += 100.0  # after a hole the arm is elsewhere
    made = Instruments((4.0, 4.0), {}, reference=False)(
        session(position, segments=[slice(0, 450), slice(450, 900)])
    )
    expected = slow + np.where(np.arange(900) >= 450, 100.0, 0.0)
    inner = np.r_[60:390, 510:840]
    np.testing.assert_allclose(made[inner, 0], expected[inner], atol=0.02)
    assert position[0, 0] == slow[0] + fast[0]  # the session keeps its own


@pytest.mark.parametrize(
    ("begin", "end", "period", "covers"),
    [
        (0.0, 9.0, 2.0, True),
        (0.0, 10 * MOST + 0.01, 2.0, True),
        (0.0, 10 * MOST - 0.02, 2.0, False),
        (0.0, 9.0, 4.6, False),
        (0.0, 9.0, 4.4, True),
    ],
)
def test_a_stretch_serves_that_has_two_repeats_and_most_of_the_session(begin, end, period, covers):
    time = np.arange(begin, end + STEP / 2, STEP)
    stretch = (SimpleNamespace(time=time), period)
    assert _covers(stretch, np.array([0.0, 10.0])) is covers  # type: ignore[arg-type]


def test_the_band_of_a_motion_is_twice_that_of_most_of_its_speed_between_what_a_session_and_the_filter_tell():
    def of(frequency):
        return np.sin(2 * np.pi * frequency * TIME)

    sessions = {"a": session(np.column_stack([of(1.0), np.zeros(len(TIME)), of(30.0)]))}
    record = SimpleNamespace(
        settings=SimpleNamespace(decimation_cutoff=20.0),
        entries=lambda: list(sessions),
        session=sessions.__getitem__,
        joints=3,
    )
    one, still, fast = motion_band(record)  # type: ignore[arg-type]
    assert one == pytest.approx(BAND * 1.0, rel=0.15)
    assert still == pytest.approx(BAND * 1 / 9.0)  # nothing below one turn in the whole session can be told
    assert fast == BELOW_THE_FILTER * 20.0
