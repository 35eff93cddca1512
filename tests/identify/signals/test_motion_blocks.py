"""Blocks of motion and the filters, against closed forms."""

from pathlib import Path

import numpy as np
import pytest

from identify.recording import Payload, Session, SessionEntry
from identify.signals import SignalSettings, motion_blocks


def record(position, period, command=None):
    position = np.reshape(position, (len(position), -1))
    entry = SessionEntry("made.csv", Path("made.csv"), Payload(name="none", mass=0.0), "identification")
    time = period * np.arange(len(position))
    whole = (slice(0, len(position)),)
    return Session(entry, time, position, position if command is None else command, whole, period)


def test_a_sinusoid_gives_its_own_derivatives():
    period, frequency = 1e-3, 2.0
    time = period * np.arange(8000)
    session = record(np.sin(2 * np.pi * frequency * time), period)
    omega = 2 * np.pi * frequency
    (block,) = motion_blocks(session, SignalSettings((50.0,), 20.0))
    middle = slice(500, -500)
    gain = 1 / (1 + (np.tan(np.pi * frequency * period) / np.tan(np.pi * 50 * period)) ** 8)
    phase = omega * block.time[middle]
    np.testing.assert_allclose(block.q[middle, 0], gain * np.sin(phase), atol=1e-7)
    np.testing.assert_allclose(block.dq[middle, 0], gain * omega * np.cos(phase), atol=2e-6)
    np.testing.assert_allclose(block.ddq[middle, 0], -gain * omega**2 * np.sin(phase), atol=2e-5)


@pytest.mark.parametrize("largest", [700, 1000, 4096])
def test_blocks_give_what_the_whole_record_gives(largest):
    rng = np.random.default_rng(1)
    period = 1e-3
    position = np.cumsum(np.cumsum(rng.standard_normal((20_000, 2)), axis=0), axis=0) * 1e-6
    session = record(position, period)
    settings = SignalSettings((50.0, 40.0), 20.0)
    decimated = []
    for size in (10**6, largest):
        blocks = [
            block.decimate(np.column_stack([block.q, block.dq, block.ddq, block.command]))
            for block in motion_blocks(session, settings, largest_block=size)
        ]
        decimated.append(np.concatenate(blocks))
    whole, pieces = decimated
    assert len(pieces) == len(whole)
    scale = np.abs(whole).max(axis=0)
    assert np.max(np.abs(pieces - whole) / scale) < 1e-7
