"""Uniform time: segments, holes, resampling; nothing interpolated across a hole, everything said."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.recording import InputError, Payload, SessionEntry, sampling
from identify.recording.interpolation import interpolate
from identify.recording.samples import RawSamples
from identify.recording.sampling import uniform_session

ENTRY = SessionEntry("made.csv", Path("made.csv"), Payload(name="none", mass=0.0), "identification")


def motion(time):
    """(N, 2) two joints that swing at 0.5 and 1 Hz."""
    return np.stack([np.sin(np.pi * time), 0.3 * np.cos(2 * np.pi * time)], axis=1)


def session_at(time, extra=None):
    """A session recorded at the given instants, whose command is 5 t - 1 on both joints."""
    command = np.stack([5 * time - 1, 5 * time - 1], axis=1)
    return uniform_session(ENTRY, RawSamples(time, motion(time), command, extra=dict(extra or {})))


@pytest.mark.parametrize("period", [1e-4, 2e-4, 1e-3, 4e-3, 0.1])
@pytest.mark.parametrize("start", [0.0, 17.3, 1.7e9])
def test_a_uniform_record_is_used_as_it_is(period, start):
    time = start + period * np.arange(3000)
    session = session_at(time)
    assert session.remarks == ()
    assert session.segments == (slice(0, 3000),)
    assert session.time is not None
    np.testing.assert_array_equal(session.time, time)
    np.testing.assert_array_equal(session.position, motion(time))
    assert session.sampling_period == pytest.approx(period, rel=1e-3)


def test_reading_a_clock_a_little_late_is_no_reason_to_resample():
    rng = np.random.default_rng(3)
    time = 1e-3 * np.arange(5000) + rng.uniform(-5e-6, 5e-6, 5000)
    session = session_at(time)
    assert session.remarks == ()
    np.testing.assert_array_equal(session.position, motion(time))


def test_times_written_with_few_digits_are_those_of_a_regular_clock():
    time = np.arange(6000) / 3000
    session = session_at(np.round(time, 4))
    assert len(session.remarks) == 1
    assert "rounded to 0.0001 s" in session.remarks[0]
    np.testing.assert_allclose(session.time, time, atol=1e-4)
    assert np.ptp(np.diff(session.time)) < 1e-12
    assert session.sampling_period == pytest.approx(1 / 3000, rel=1e-4)


def test_jitter_is_resampled_to_the_median_period_and_said():
    rng = np.random.default_rng(4)
    ticks = np.cumsum(rng.uniform(0.6e-3, 1.4e-3, 5000))
    session = session_at(ticks)
    assert any("not uniform" in remark for remark in session.remarks)
    assert np.ptp(np.diff(session.time)) < 1e-9
    assert session.sampling_period == pytest.approx(1e-3, rel=0.02)
    # A cubic through four neighbours is off by h^4/24 times the fourth derivative, (2 pi)^4 here.
    np.testing.assert_allclose(session.position, motion(session.time), atol=1e-9)
    np.testing.assert_allclose(session.command[:, 0], 5 * session.time - 1, atol=1e-9)


def test_one_sample_in_a_hundred_missing_is_bridged_and_counted():
    rng = np.random.default_rng(5)
    whole = 1e-3 * np.arange(10_000)
    gone = rng.choice(np.arange(1, 9999), 100, replace=False)
    session = session_at(np.delete(whole, gone))
    assert len(session.remarks) == 1
    assert "100 missing samples (0.01 of all) bridged" in session.remarks[0]
    np.testing.assert_allclose(session.time, whole, atol=1e-9)
    np.testing.assert_allclose(session.position, motion(whole), atol=1e-10)
    np.testing.assert_allclose(session.command[:, 0], 5 * whole - 1, atol=1e-9)
    kept = np.delete(np.arange(10_000), gone)
    np.testing.assert_array_equal(session.position[kept], motion(whole[kept]))


@pytest.mark.parametrize(("period", "bridged"), [(1e-4, 5), (1e-3, 5), (2e-3, 5), (5e-3, 2), (0.1, 1)])
def test_so_many_missing_samples_are_bridged_and_one_more_is_a_hole(period, bridged):
    whole = period * np.arange(400)
    short = session_at(np.delete(whole, range(200, 200 + bridged)))
    assert short.segments == (slice(0, 400),)
    long = session_at(np.delete(whole, range(200, 201 + bridged)))
    assert [piece.stop - piece.start for piece in long.segments] == [200, 199 - bridged]
    assert "1 hole" in long.remarks[0]
    assert "nothing interpolated across" in long.remarks[0]


def test_nothing_is_made_up_inside_a_hole():
    whole = 1e-3 * np.arange(6000)
    keep = np.concatenate([np.arange(0, 2000), np.arange(2500, 4000), np.arange(4003, 6000)])
    session = session_at(whole[keep])
    assert len(session.segments) == 2
    time = np.concatenate([session.time[piece] for piece in session.segments])
    assert not ((time > 1.9995) & (time < 2.4995)).any()
    assert len(time) == 5500
    assert any("3 missing samples" in remark for remark in session.remarks)


def test_pieces_too_short_for_anything_are_left_out_and_counted():
    whole = 1e-3 * np.arange(1000)
    keep = np.concatenate([np.arange(0, 400), np.arange(450, 460), np.arange(500, 1000)])
    session = session_at(whole[keep])
    assert [piece.stop - piece.start for piece in session.segments] == [400, 500]
    assert any("10 samples" in remark and "left out" in remark for remark in session.remarks)
    assert session.position[session.segments[1]][0] == pytest.approx(motion(whole[500:501])[0])


def test_a_record_of_crumbs_is_refused():
    time = np.concatenate([k + 1e-3 * np.arange(8) for k in range(10)])
    with pytest.raises(InputError, match=r"made\.csv: time jumps so often"):
        session_at(time)


def test_extra_columns_follow_the_resampling():
    rng = np.random.default_rng(6)
    time = np.cumsum(rng.uniform(0.7e-3, 1.3e-3, 2000))
    state = np.array(["a"] * 1000 + ["b"] * 1000, dtype=object)
    session = session_at(time, {"twice": 2 * time, "state": state})
    np.testing.assert_allclose(session.extra["twice"], 2 * session.time, atol=1e-12)
    changed = int(np.argmax(session.extra["state"] == "b"))
    assert session.time[changed] >= time[1000] > session.time[changed - 1]


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 1000), block=st.integers(40, 3000), jitter=st.sampled_from([0.0, 0.3]))
def test_working_in_blocks_changes_nothing(seed, block, jitter):
    rng = np.random.default_rng(seed)
    time = 1e-3 * (np.arange(4000) + rng.uniform(-jitter, jitter, 4000))
    time = np.delete(time, rng.choice(np.arange(2, 3990), 30, replace=False))
    time[2000:] += 0.25
    whole = session_at(time)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sampling, "BLOCK", block)
        pieces = session_at(time)
    assert pieces.segments == whole.segments
    assert pieces.remarks == whole.remarks
    assert pieces.sampling_period == whole.sampling_period
    np.testing.assert_allclose(pieces.time, whole.time, atol=1e-12)
    np.testing.assert_allclose(pieces.position, whole.position, atol=1e-12)


@settings(max_examples=50, deadline=None)
@given(
    steps=st.lists(st.floats(0.5, 1.5), min_size=6, max_size=40),
    coefficients=st.lists(st.floats(-3, 3), min_size=4, max_size=4),
)
def test_the_cubic_interpolates_cubics_exactly(steps, coefficients):
    old = np.cumsum(steps) / len(steps)
    new = np.linspace(old[0], old[-1], 57)
    expected = np.polyval(coefficients, new)
    found = interpolate(old, np.polyval(coefficients, old)[:, None], new, cubic=True)[:, 0]
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_holes_are_counted_placed_and_the_longest_is_measured():
    """Every 2 ms but for 0.5 s after 2 s and 0.25 s after 5 s of motion; the clock began at 100 s."""
    time = 100.0 + 0.002 * np.arange(5000)
    time[1001:] += 0.5
    time[2501:] += 0.25
    session = session_at(time)
    assert len(session.segments) == 3
    assert session.remarks == (
        "2 holes in the record (after 102 s, 105.5 s; the longest 0.502 s): split into 3 segments,"
        " nothing interpolated across",
    )


def test_a_piece_in_which_time_all_but_stands_still_is_left_out_and_said():
    time = np.concatenate([1e-9 * np.arange(300), 1e9 + 1e-3 * np.arange(300)])
    session = session_at(time)
    assert session.segments == (slice(0, 300),) or session.segments == (slice(300, 600),)
    assert session.sampling_period == pytest.approx(1e-3, rel=1e-3)
    assert session.remarks
