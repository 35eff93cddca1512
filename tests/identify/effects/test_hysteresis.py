"""Effects with memory against their defining equations, sample by sample."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.effects.hysteresis import Backlash, Presliding, built_up, place_in_gap, remembered
from identify.effects.motion import BlockMemory
from tests.identify.effects.motions import PERIOD, motion_of


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
    state = built_up(position, -0.4, distance)
    value = -0.4
    for k in range(1, len(position)):
        step = position[k] - position[k - 1]
        direction = np.sign(step)
        value = direction + (value - direction) * np.exp(-abs(step) / distance)
        assert state[k] == pytest.approx(value, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), width=st.floats(0.005, 1.0))
def test_the_play_operator_is_pushed_by_either_flank(seed, width):
    position = wandering(seed)
    place = place_in_gap(position, 0.2, width)
    link = position[0] + 0.2 * width
    for k in range(1, len(position)):
        link = min(max(link, position[k] - width / 2), position[k] + width / 2)
        assert place[k] == pytest.approx((link - position[k]) / width, abs=1e-9)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), cut=st.integers(150, 450))
@pytest.mark.parametrize(
    ("effect", "constants"), [(Presliding(), {"presliding_distance": 0.05}), (Backlash(), {"play": 0.3})]
)
def test_the_state_goes_on_from_block_to_overlapping_block(effect, constants, seed, cut):
    position, time = wandering(seed), np.arange(600.0)

    def along(part: slice, memory: BlockMemory) -> np.ndarray:
        # the direction of the second block's first sample tells nothing any more
        seen = motion_of(q=position[part], time=time[part], direction=np.ones(600)[part], memory=memory)
        return remembered(effect, seen, constants)

    whole = along(slice(None), BlockMemory())
    memory = BlockMemory()
    along(slice(0, cut + 50), memory)
    np.testing.assert_allclose(along(slice(cut - 50, None), memory), whole[cut - 50 :], atol=1e-9)


def test_pushed_by_motion_the_link_hangs_back_by_half_the_gap():
    """s in parts of the gap: -1/2 while the motor pushes forward, 1/2 backward, and between them right after a reversal."""
    seen = motion_of(load_slope_of=lambda: np.full(500, 3.0))
    place = Backlash().columns(seen, {"play": 0.01})[:, 0] / 3.0
    turned = int(np.argmax(seen.dq < 0))
    pushed = np.abs(seen.q - seen.q[turned]) > 0.011
    pushed[:5] = False
    np.testing.assert_allclose(place[pushed], -0.5 * np.sign(seen.dq)[pushed], atol=1e-9)
    between = place[turned : turned + 5]
    assert np.all(np.diff(between) >= 0)
    assert np.all(np.abs(between) < 0.5 + 1e-9)


@pytest.mark.parametrize("first", [0.0, 1.0, -1.0])
def test_a_memory_follows_the_positions_whenever_their_direction_is_said_to_turn(first):
    """By loops of our own: a reversal that is known a sample sooner changes nothing; at rest nothing is built up."""
    random = np.random.default_rng(5)
    q = np.cumsum(random.normal(0.0, 1e-3, 500)) + 0.02 * np.sin(np.arange(500) / 40)
    q[100:110] = q[99]
    direction = np.sign(np.gradient(np.roll(q, 3)))
    direction[0] = first
    seen = motion_of(q=q, direction=direction, load_slope_of=lambda: np.full(500, 3.0))
    link, bristle = [q[0] - 0.005 * first], [first]
    for before, position in pairwise(q):
        link.append(min(max(link[-1], position - 0.005), position + 0.005))
        heading = float(np.sign(position - before))
        bristle.append(heading + (bristle[-1] - heading) * np.exp(-abs(position - before) / 0.01))
        if heading == 0.0:
            bristle[-1] = bristle[-2]
    place = Backlash().columns(seen, {"play": 0.01})[:, 0] / 3.0
    np.testing.assert_allclose(place, (np.array(link) - q) / 0.01, atol=1e-12)
    built_up = Presliding().columns(seen, {"presliding_distance": 0.01})[:, 0] + direction
    np.testing.assert_allclose(built_up, bristle, atol=1e-12)


def test_pushed_by_load_the_link_lies_against_the_flank_that_the_load_leans_on():
    seen = motion_of()
    columns = Backlash().columns(seen, {"flank_load": 8.0, "rotor_inertia": 0.5})
    load = seen.load - 0.5 * seen.ddq
    place = -0.5 * np.tanh(load / 8.0)
    np.testing.assert_allclose(columns[:, 0], seen.load_slope_of() * place, rtol=1e-12, atol=1e-12)
    acceleration = (place[2:] - 2 * place[1:-1] + place[:-2]) / PERIOD**2
    inner = slice(20, -20)
    scale = np.abs(acceleration).max()
    np.testing.assert_allclose(columns[1:-1, 1][inner], -acceleration[inner], atol=0.02 * scale)


def test_a_state_that_is_carried_over_a_way_is_dahls_and_stays_where_nothing_moves():
    state, travel = np.array([0.3, -0.8, 0.5]), np.array([0.02, -0.01, 0.0])
    carried = Presliding().state_after(state, travel, {"presliding_distance": 0.01})
    steps = 20_000
    value = state.copy()
    for _ in range(steps):  # dz/dq = (1 - z sign(dq)) / distance
        value = value + travel / steps * (1 - value * np.sign(travel)) / 0.01
    np.testing.assert_allclose(carried, value, atol=1e-3)
    assert carried[2] == 0.5
