"""Where a command was cut, told from commands that stand for another reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.estimation.command_limits import PIECE, limits, standing, standing_in_parts
from identify.estimation.record import Record
from identify.recording import load_experiment
from tests.plants.single_joint import Joint, record, write_experiment

RATE = 500.0
TIME = np.arange(0.0, 20.0, 1 / RATE)
STEP = 1e-4
NONE = (-np.inf, np.inf)


def recorded(course):
    """As an encoder has it, (N, 1)."""
    return (np.round(course / STEP) * STEP)[:, None]


SWING = recorded(0.5 * np.sin(2 * np.pi * 0.7 * TIME))
CURRENT = (
    4.0 * np.sin(2 * np.pi * 0.7 * TIME + 0.3)
    + 2.0 * np.sin(2 * np.pi * 1.9 * TIME)
    + 0.02 * np.random.default_rng(1).standard_normal(len(TIME))
)


def of(command, position=SWING):
    return limits([standing(command, position, np.array([STEP]))])


@pytest.mark.parametrize("part", [0.6, 0.75, 0.9])
def test_a_command_that_was_cut_is_found_on_either_side(part):
    top, bottom = part * CURRENT.max(), part * CURRENT.min()
    assert of(np.minimum(CURRENT, top)) == (-np.inf, top)
    assert of(np.maximum(CURRENT, bottom)) == (bottom, np.inf)
    assert of(np.clip(CURRENT, bottom, top)) == (bottom, top)
    # a limit of which one side is hardly reached
    once = np.minimum(np.where(CURRENT < 0, 0.99 * CURRENT * top / -CURRENT.min(), CURRENT), top)
    once[np.argmin(CURRENT)] = -top
    assert of(once) == (-top, top)
    # rounded as well: six hundred steps from end to end
    coarse = np.round(np.clip(CURRENT, bottom, top) / 0.02) * 0.02
    assert of(coarse) == (coarse.min(), coarse.max())


def constant_speed(speeds):
    """There and back at each speed in turn, the same way each time."""
    turns = np.sign(np.sin(2 * np.pi * 0.5 * TIME + 1e-9))
    speed = np.repeat(speeds, len(TIME) // len(speeds)) * turns
    return speed, recorded(np.cumsum(speed) / RATE)


@pytest.mark.parametrize("step", [1e-6, 0.05, 0.5])
@pytest.mark.parametrize("power", [2, 4])
def test_a_rounded_command_is_not_cut_however_flat_its_top(step, power):
    top = 1.0 - np.abs((2 * 0.7 * TIME) % 2 - 1) ** power
    command = np.round(5.0 * top * np.sign(np.sin(2 * np.pi * 0.35 * TIME)) / step) * step
    assert of(command) == NONE


def test_friction_in_even_motion_is_no_limit():
    for speeds in ([0.3], [0.1, 0.2], [0.1, 0.2, 0.3, 0.4]):
        speed, position = constant_speed(speeds)
        assert of(np.round((2.0 * np.sign(speed) + 3.0 * speed) / 0.01) * 0.01, position) == NONE


def test_a_command_of_a_few_levels_is_not_cut():
    assert of(np.where(CURRENT > 0, 4.0, -4.0)) == NONE
    assert of(4.0 * np.round(CURRENT / 3.0)) == NONE


def test_what_holds_a_joint_at_rest_is_no_limit():
    """A load that is held with a constant current, the largest of all, between motions."""
    held = (TIME % 4.0) < 1.5
    command = np.where(held, CURRENT.max() + 1.0, CURRENT)
    position = np.where(held[:, None], 0.25, SWING)
    assert of(command, position) == NONE
    assert of(np.full_like(TIME, 3.0)) == NONE
    assert of(np.full_like(TIME, np.nan)) == NONE


def test_a_drive_that_is_off_is_not_cut():
    assert of(np.maximum(CURRENT, 0.0)) == NONE


def test_a_short_record_has_no_limits():
    assert of(CURRENT[:1], SWING[:1]) == NONE
    assert of(CURRENT[:2], SWING[:2]) == NONE


def test_limits_are_those_of_all_sessions_and_of_all_parts(monkeypatch):
    steps = np.array([STEP])
    top = 0.7 * CURRENT.max()
    light = standing(0.5 * CURRENT, SWING, steps)
    cut = standing(np.minimum(CURRENT, top), SWING, steps)
    assert limits([light, cut]) == (-np.inf, top)
    # where another session goes beyond, nothing was cut
    assert limits([standing(CURRENT, SWING, steps), cut]) == NONE
    assert len(TIME) < PIECE
    monkeypatch.setattr("identify.estimation.command_limits.PIECE", 1000)
    session = type("", (), {"time": TIME, "position": SWING, "command": np.minimum(CURRENT, top)[:, None]})
    parts = standing_in_parts(session, 0, np.array([0]), steps)  # type: ignore[arg-type]
    assert len(parts) == 10
    assert limits(parts) == (-np.inf, top)


def test_what_the_filter_mixes_with_a_cut_command_takes_no_part(tmp_path):
    made = record({}, seed=2, joint=Joint(), duration=12.0, rate=250.0, payload_masses=(0.0, 4.0))
    top = 0.7 * max(float(np.abs(columns["v1"]).max()) for columns in made.sessions)
    sessions = tuple(columns | {"v1": np.clip(columns["v1"], -top, top)} for columns in made.sessions)
    cut = Record.of(load_experiment(write_experiment(tmp_path / "cut", replace(made, sessions=sessions))))
    whole = Record.of(load_experiment(write_experiment(tmp_path / "whole", made)))
    assert np.abs(cut.command_limits[np.isfinite(cut.command_limits)]) == pytest.approx(top, rel=1e-4)
    assert not np.isfinite(whole.command_limits).any()
    for entry in cut.entries():
        at_limit = cut.at_limit(entry)[:, 0]
        moving, before = (each.samples[entry.file].moving[:, 0] for each in (cut, whole))
        time, instants = cut.samples[entry.file].time, cut.session(entry).time[at_limit]
        assert not (moving & ~before).any()
        # half a period of the filter's cut-off is its main lobe
        lobe = 0.5 / cut.settings.decimation_cutoff
        near = np.array([np.any(np.abs(instants - each) < lobe) for each in time])
        assert not moving[near].any()
        far = np.array([np.all(np.abs(instants - each) > 4 * lobe) for each in time])
        np.testing.assert_array_equal(moving[far], before[far])
        assert near.any() == (entry.payload.mass > 0)
