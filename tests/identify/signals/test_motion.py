"""Blocks of motion: what they give is what the whole record gives, and that is right."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from identify.recording import InputError
from identify.recording.samples import SampleColumns
from identify.signals import SignalSettings, motion_blocks
from identify.signals.motion import left_out


def gathered(session, chosen, largest=None):
    """Decimated time and q, dq, ddq, direction and command through the parallel filter, of all blocks."""
    blocks = [
        (
            block.decimated_time,
            block.decimate(np.hstack([block.q, block.dq, block.ddq, block.direction, block.command])),
        )
        for block in motion_blocks(session, chosen, largest)
    ]
    return np.concatenate([time for time, _ in blocks]), np.concatenate([columns for _, columns in blocks])


def test_a_sinusoid_gives_its_own_derivatives(made_session):
    period, frequency = 1e-3, 2.0
    omega = 2 * np.pi * frequency
    session = made_session(np.sin(omega * period * np.arange(8000)), period)
    (block,) = motion_blocks(session, SignalSettings((50.0,), 20.0))
    middle = slice(500, -500)
    gain = 1 / (1 + (np.tan(np.pi * frequency * period) / np.tan(np.pi * 50 * period)) ** 8)
    phase = omega * block.time[middle]
    np.testing.assert_allclose(block.q[middle, 0], gain * np.sin(phase), atol=1e-8)
    np.testing.assert_allclose(block.dq[middle, 0], gain * omega * np.cos(phase), rtol=0, atol=1e-7 * omega)
    np.testing.assert_allclose(
        block.ddq[middle, 0], -gain * omega**2 * np.sin(phase), rtol=0, atol=1e-6 * omega**2
    )


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    seed=st.integers(0, 99),
    rate=st.sampled_from([200.0, 1000.0, 5000.0]),
    cutoff=st.floats(15.0, 80.0),
    decimation=st.floats(5.0, 40.0),
    largest=st.integers(10, 5000),
    hole=st.integers(3000, 9000),
)
def test_blocks_of_any_size_give_what_the_whole_record_gives(
    made_session, seed, rate, cutoff, decimation, largest, hole
):
    rng = np.random.default_rng(seed)
    position = 1 + np.cumsum(np.cumsum(rng.standard_normal((12_000, 2)), axis=0), axis=0) * 1e-6
    command = rng.standard_normal((12_000, 2))
    session = made_session(position, 1 / rate, command, (slice(0, hole), slice(hole, 12_000)))
    chosen = SignalSettings((cutoff, 0.8 * cutoff), decimation)
    time, whole = gathered(session, chosen, 10**6)
    pieces_time, pieces = gathered(session, chosen, largest)
    np.testing.assert_array_equal(pieces_time, time)
    assert np.max(np.abs(pieces - whole) / np.abs(whole).max(axis=0)) < 1e-7


def test_nothing_of_one_segment_reaches_the_other(made_session):
    rng = np.random.default_rng(0)
    position = np.sin(0.01 * np.arange(8000))
    command = rng.standard_normal(8000)
    cut = (slice(0, 4000), slice(4000, 8000))
    chosen = SignalSettings((40.0,), 20.0)
    _, before = gathered(made_session(position, 1e-3, command, cut), chosen)
    position[4000:] += 5.0
    command[4000:] *= 100.0
    _, after = gathered(made_session(position, 1e-3, command, cut), chosen)
    half = len(before) // 2
    np.testing.assert_array_equal(before[:half], after[:half])


def test_a_fast_record_is_looked_at_every_millisecond_without_aliasing(made_session):
    period = 1e-4
    time = period * np.arange(60_000)
    position = np.sin(2 * np.pi * time)
    slow = np.cos(2 * np.pi * 3 * time)
    ripple = np.sin(2 * np.pi * 1003.0 * time)  # would look like 3 Hz at 1 kHz
    session = made_session(position, period, slow + ripple)
    chosen = SignalSettings((40.0,), 20.0)
    (block,) = motion_blocks(session, chosen)
    assert block.sampling_period == pytest.approx(1e-3)
    assert block.rows.step == 10
    np.testing.assert_allclose(block.time, time[block.rows])
    middle = slice(200, -200)
    np.testing.assert_allclose(block.command[middle, 0], slow[block.rows][middle], atol=1e-3)
    gain = 1 / (1 + (np.tan(np.pi * 3 * 1e-3) / np.tan(np.pi * 20 * 1e-3)) ** 8)
    expected = gain * np.cos(2 * np.pi * 3 * block.decimated_time)
    np.testing.assert_allclose(block.decimate(block.command)[5:-5, 0], expected[5:-5], atol=2e-5)


@pytest.mark.parametrize("start", [0.0, 0.13, 0.5])
def test_a_record_that_begins_and_ends_in_full_motion_has_clean_edges(made_session, start):
    time = start + 1e-3 * np.arange(3000)
    omega = 2 * np.pi * 1.5
    position, velocity, acceleration = (
        np.sin(omega * time),
        omega * np.cos(omega * time),
        -(omega**2) * np.sin(omega * time),
    )
    torque = 2.0 * acceleration + 5.0 * velocity + 3.0
    session = made_session(position, 1e-3, torque)
    (block,) = motion_blocks(session, SignalSettings((50.0,), 20.0))
    columns = block.decimate(np.column_stack([block.ddq, block.dq, np.ones_like(block.dq)]))
    measured = block.decimate(block.command)[:, 0]
    found = np.linalg.lstsq(columns, measured, rcond=None)[0]
    np.testing.assert_allclose(found, [2.0, 5.0, 3.0], rtol=5e-3)
    assert np.linalg.norm(measured - columns @ found) < 5e-3 * np.linalg.norm(measured)


def test_columns_of_any_shape_are_filtered_alike(made_session):
    rng = np.random.default_rng(1)
    session = made_session(rng.standard_normal((3000, 2)), 1e-3)
    (block,) = motion_blocks(session, SignalSettings((50.0, 50.0), 20.0))
    cube = rng.standard_normal((len(block.time), 2, 5))
    result = block.decimate(cube)
    assert result.shape == (block.count, 2, 5)
    np.testing.assert_allclose(result[:, 1, 3], block.decimate(np.asfortranarray(cube[:, 1, 3])), atol=1e-13)
    with pytest.raises(ValueError, match="rows"):
        block.decimate(cube[:-1])


def test_samples_mapped_from_a_file_give_the_same_blocks(made_session):
    rng = np.random.default_rng(2)
    position = np.cumsum(rng.standard_normal((20_000, 2)), axis=0) * 1e-3
    mapped = SampleColumns(2, largest_in_memory=0)
    for first in range(0, 20_000, 3000):
        mapped.append(position[first : first + 3000])
    chosen = SignalSettings((40.0, 40.0), 20.0)
    there = gathered(made_session(position, 1e-3), chosen, 2000)[1]
    np.testing.assert_array_equal(gathered(made_session(mapped.array(), 1e-3), chosen, 2000)[1], there)


def test_a_record_too_short_for_the_filters_is_refused_with_what_would_do(made_session):
    session = made_session(np.sin(0.01 * np.arange(300)), 1e-3)
    with pytest.raises(
        InputError, match=r"made\.csv: 0\.3 s .* too short .* set higher cut-offs under 'signals'"
    ):
        list(motion_blocks(session, SignalSettings((5.0,), 2.0)))


def test_a_segment_too_short_for_the_filters_is_left_out_and_said(made_session):
    position = np.sin(0.01 * np.arange(5000))
    session = made_session(position, 1e-3, segments=(slice(0, 4950), slice(4950, 5000)))
    chosen = SignalSettings((40.0,), 20.0)
    assert {block.segment for block in motion_blocks(session, chosen)} == {0}
    assert left_out(session, chosen) == ("made.csv: 1 segment (0.05 s) too short for the filters, left out",)
    assert left_out(made_session(position, 1e-3), chosen) == ()


@pytest.mark.parametrize("rows", [6000, 6001, 6019, 6020, 6021])
@pytest.mark.parametrize("rate", [1000.0, 5000.0])
def test_the_edges_of_every_segment_are_trimmed_alike_and_nothing_more(made_session, rate, rows):
    """A decimated sample is kept if it is as far from either end as the filters see beyond it, and not otherwise."""
    samples = round(rows * rate / 1000.0)
    chosen = SignalSettings((50.0,), 20.0)
    session = made_session(np.sin(np.arange(samples) / rate), 1 / rate)
    time = np.concatenate([block.decimated_time for block in motion_blocks(session, chosen, 700)])
    step = chosen.decimation_factor(1 / rate) / rate
    np.testing.assert_allclose(np.diff(time), step)
    trimmed, last = chosen.edge(), (samples - 1) / rate
    assert trimmed <= time[0] < trimmed + step
    # the last decimated sample of the segment is as many steps behind the last that is kept as the first is
    assert round(time[0] / step) == int(last / step + 1e-9) - round(time[-1] / step)
