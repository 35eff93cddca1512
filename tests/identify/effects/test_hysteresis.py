"""Effects with memory against their defining equations, sample by sample."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.effects.hysteresis import dahl_state, play_position
from identify.effects.motion import BlockMemory


def motion(position: np.ndarray, time: np.ndarray, memory: BlockMemory) -> SimpleNamespace:
    direction = np.sign(np.diff(position, prepend=position[:1]))
    return SimpleNamespace(joint=0, time=time, q=position, direction=direction, memory=memory)


def wandering(seed: int, count: int = 600) -> np.ndarray:
    random = np.random.default_rng(seed)
    time = np.linspace(0, 6, count)
    return sum(
        random.uniform(0.1, 1) * np.sin(random.uniform(0.5, 6) * time + random.uniform(0, 6))
        for _ in range(4)
    )


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), distance=st.floats(0.005, 0.5))
def test_dahls_state_is_the_integral_of_its_differential_equation(seed, distance):
    position = wandering(seed)
    state = dahl_state(motion(position, np.arange(len(position)), BlockMemory()), distance)  # type: ignore[arg-type]
    value = state[0]
    for k in range(1, len(position)):
        step = position[k] - position[k - 1]
        direction = np.sign(step)
        value = direction + (value - direction) * np.exp(-abs(step) / distance)
        assert state[k] == pytest.approx(value, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), width=st.floats(0.005, 1.0))
def test_the_play_operator_is_pushed_by_either_flank(seed, width):
    position = wandering(seed)
    link = play_position(motion(position, np.arange(len(position)), BlockMemory()), width)  # type: ignore[arg-type]
    value = link[0]
    for k in range(1, len(position)):
        value = min(max(value, position[k] - width / 2), position[k] + width / 2)
        assert link[k] == pytest.approx(value, abs=1e-9)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), cut=st.integers(150, 450))
def test_the_state_goes_on_from_block_to_overlapping_block(seed, cut):
    position, time = wandering(seed), np.arange(600.0)
    whole = dahl_state(motion(position, time, BlockMemory()), 0.05)  # type: ignore[arg-type]
    memory = BlockMemory()
    dahl_state(motion(position[: cut + 50], time[: cut + 50], memory), 0.05)  # type: ignore[arg-type]
    second = dahl_state(motion(position[cut - 50 :], time[cut - 50 :], memory), 0.05)  # type: ignore[arg-type]
    np.testing.assert_allclose(second, whole[cut - 50 :], atol=1e-9)
