"""Positions that jump: what wraps is continued, what was held is left out, what is motion is left alone."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.recording import InputError, Payload, SessionEntry, position_jumps
from identify.recording.samples import RawSamples
from identify.recording.sampling import uniform_session

ENTRY = SessionEntry("made.csv", Path("made.csv"), Payload(name="none", mass=0.0), "identification")
TIME = np.arange(6000) / 500.0
TURN = 2 * np.pi


def swing(time, reach=1.4, noise=1e-5):
    """(N,) rad, two sines that pass zero often, as an encoder with a little noise gives them."""
    noisy = noise * np.random.default_rng(1).standard_normal(len(time))
    return reach * (0.8 * np.sin(1.7 * time + 0.3) + 0.2 * np.sin(5.1 * time)) + noisy


def session_of(*positions, time=TIME):
    position = np.stack(positions, axis=1)
    return uniform_session(ENTRY, RawSamples(np.array(time), position, np.zeros_like(position)))


@pytest.mark.parametrize("lowest", [0.0, -np.pi])
def test_an_angle_that_wraps_at_a_turn_is_continued(lowest):
    true = swing(TIME, reach=2.0) + (0.0 if lowest == 0.0 else 2.5)
    session = session_of((true - lowest) % TURN + lowest, swing(TIME + 5))
    assert len(session.remarks) == 1
    assert "position of joint 1 wraps round by 6.28319" in session.remarks[0]
    assert session.segments == (slice(0, len(TIME)),)
    away = (session.position[:, 0] - true) / TURN
    np.testing.assert_allclose(away, round(float(away[0])), atol=1e-9)
    np.testing.assert_array_equal(session.position[:, 1], swing(TIME + 5))


@pytest.mark.parametrize("modulus", [2**15, 2**16, 2**32, 10_000])
def test_a_counter_that_wraps_at_its_modulus_is_continued_with_its_mean_nearest_to_zero(modulus):
    unit = TURN / 2**17
    counts = np.round(swing(TIME, reach=0.2) / unit).astype(np.int64)
    session = session_of((counts % modulus) * unit)
    assert "wraps round" in session.remarks[0]
    # A modulus that no wrap tells exactly is known to the change of speed in one sample, a count or two.
    np.testing.assert_allclose(session.position[:, 0], counts * unit, atol=3 * unit)


def test_a_joint_that_turns_on_and_on_is_continued_over_all_its_turns():
    true = 9.0 * TIME + 0.5 * np.sin(3 * TIME)
    session = session_of(true % TURN)
    np.testing.assert_allclose(np.diff(session.position[:, 0]), np.diff(true), atol=1e-9)


def test_a_wrap_is_continued_also_in_a_session_of_several_blocks(monkeypatch):
    monkeypatch.setattr(position_jumps, "BLOCK", 700)
    true = 9.0 * TIME
    session = session_of(true % TURN)
    np.testing.assert_allclose(np.diff(session.position[:, 0]), np.diff(true), atol=1e-9)


def test_a_new_zero_is_a_border_and_is_said():
    position = swing(TIME)
    position[2500:] -= 0.9
    session = session_of(position)
    assert [(rows.start, rows.stop) for rows in session.segments] == [(0, 2500), (2500, 6000)]
    assert "jumps by up to 0.9 (after 4.998 s)" in session.remarks[0]
    assert "zero was set anew" in session.remarks[0]
    np.testing.assert_array_equal(session.position[:, 0], position)


def test_a_slide_that_is_zeroed_at_its_end_does_not_wrap():
    """The jump leads from the highest of all positions to the lowest, as a wrap does, but 0.37 is no modulus."""
    position = 0.37 * np.concatenate([np.linspace(0, 1, 3000), 0.9 * np.sin(np.linspace(0, 3, 3000))])
    session = session_of(position + 1e-6 * np.random.default_rng(2).standard_normal(6000))
    assert "jumps by up to 0.37" in session.remarks[0]
    assert len(session.segments) == 2


def test_values_that_were_held_until_the_position_jumped_are_left_out():
    position = swing(TIME)
    position[200:600] = position[200]
    session = session_of(position)
    assert [(rows.start, rows.stop) for rows in session.segments] == [(0, 201), (600, 6000)]
    assert "399 samples before it that repeat one position left out" in session.remarks[0]


def test_single_positions_that_are_not_of_the_motion_are_left_out():
    position = swing(TIME)
    position[[1000, 2000, 2001, 2002]] = [-7.0, -7.1, -7.2, -7.15]
    session = session_of(position)
    kept = np.concatenate([session.position[rows, 0] for rows in session.segments])
    np.testing.assert_array_equal(kept, np.delete(position, [1000, 2000, 2001, 2002]))
    assert any("4 samples in pieces" in remark for remark in session.remarks)
    assert not any("zero" in remark for remark in session.remarks)


def test_what_lies_across_a_hole_or_a_few_missing_samples_is_no_jump():
    keep = np.concatenate([np.arange(0, 2000), np.arange(3000, 4000), np.arange(4004, 6000)])
    session = session_of(swing(TIME)[keep], time=TIME[keep])
    assert not any("position" in remark for remark in session.remarks)


def crawl(time):
    return 0.02 * time


def stick_slip(time):
    """A joint that sticks for half a second and then moves on at once, by 5 mrad of 120."""
    return 0.005 * np.floor(time / 0.5)


def at_rest(time):
    return np.full_like(time, 0.3)


def flicker(time):
    """At rest between two counts."""
    return 0.3 + (np.random.default_rng(5).random(len(time)) < 0.002) * 1e-4


def quantised(time):
    return np.round(swing(time, reach=0.05) / 2e-3) * 2e-3


def quick_move(time):
    """At rest but for a move of five samples."""
    return np.interp(time, [0, 5, 5.01, 12], [0, 0, 0.5, 0.5])


def held_now_and_then(time):
    """Every second position is that of before."""
    position = swing(time)
    position[1::2] = position[::2]
    return position


MOTIONS = (swing, crawl, stick_slip, at_rest, flicker, quantised, held_now_and_then)
# The quick move begins and ends between two samples at 50 Hz, where nothing tells it from a jump.
RECORDED = [(motion, rate) for motion in MOTIONS for rate in (50.0, 500.0, 10_000.0)]


@pytest.mark.parametrize(("motion", "rate"), [*RECORDED, (quick_move, 500.0), (quick_move, 10_000.0)])
def test_what_a_joint_can_do_is_no_jump(motion, rate):
    time = np.arange(int(12 * rate)) / rate
    session = session_of(motion(time), time=time)
    assert session.remarks == ()
    assert session.segments == (slice(0, len(time)),)


@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.2, 20.0),
    st.floats(0.05, 3.0),
    st.sampled_from([100.0, 500.0, 1000.0]),
    st.integers(0, 2**32 - 1),
)
def test_smooth_motion_with_noise_never_jumps(speed, reach, rate, seed):
    rng = np.random.default_rng(seed)
    time = np.arange(2000) / rate
    position = reach * np.sin(speed / reach * time + rng.uniform(0, 6)) + 1e-4 * reach * rng.standard_normal(
        2000
    )
    assert session_of(position, time=time).remarks == ()


def test_a_record_of_nothing_but_jumps_is_refused_in_words():
    with pytest.raises(InputError, match=r"made\.csv: the position jumps so often"):
        session_of(np.where(np.arange(30) == 15, 5.0, 1e-3 * np.arange(30)), time=TIME[:30])
