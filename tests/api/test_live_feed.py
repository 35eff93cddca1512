"""Blocks of the live view: only what is new, errors with their sign, and what did not come is counted."""

from types import SimpleNamespace

import numpy as np
import pytest

from api.service import live_feed
from api.service.live_feed import BlockReader
from api.service.rig_documents import BusFigures
from daq.samples import Phase

COMPLETE = 0x03
BEGINS = 3
"""Rows before the plan begins."""


class Session:
    """A session whose live rows the test lets grow; one axis follows another by a constant error."""

    def __init__(self) -> None:
        self.rows = 0
        self.valid = np.full((10_000, 2), COMPLETE, np.uint8)

    def live(self, seconds: float):
        time = np.arange(self.rows) * 0.01
        position = np.column_stack([time, 10.0 - time])
        return SimpleNamespace(
            time=time,
            position=position,
            setpoint=position + np.array([0.5, -0.25]),
            command=2.0 * position,
            valid=self.valid[: self.rows],
            temperature=np.full((self.rows, 2), 40.0),
            cycle=100 + np.arange(self.rows),
            phase=np.where(np.arange(self.rows) < BEGINS, Phase.APPROACH, Phase.PLAN),
        )

    @property
    def progress(self):
        return SimpleNamespace(first=100 + BEGINS)


@pytest.fixture
def session() -> Session:
    return Session()


@pytest.fixture
def reader(session, monkeypatch) -> BlockReader:
    monkeypatch.setattr(
        live_feed,
        "envelope",
        lambda time, signals, rows: (time, {name: list(each) for name, each in signals.items()}),
    )
    monkeypatch.setattr(live_feed, "encode_block", lambda time, signals, axes: (time.tolist(), signals, axes))
    return BlockReader(SimpleNamespace(payload_session=session))


def test_a_block_holds_what_came_since_the_last_one(session, reader):
    assert reader.read() is None
    session.rows = 3
    assert reader.read()[0] == pytest.approx([0.0, 0.01, 0.02])
    assert reader.read() is None
    session.rows = 5
    assert reader.read()[0] == pytest.approx([0.03, 0.04])


def test_each_axis_has_position_command_and_the_error_by_which_it_falls_behind(session, reader):
    session.rows = 2
    _, signals, axes = reader.read()
    assert axes == 2
    assert signals["position 1"] == pytest.approx([10.0, 9.99])
    assert signals["command 1"] == pytest.approx([20.0, 19.98])
    assert signals["following error 0"] == pytest.approx([0.5, 0.5])
    assert signals["following error 1"] == pytest.approx([-0.25, -0.25])


def test_what_did_not_come_is_counted_once_and_other_bits_are_no_loss(session, reader):
    assert reader.figures() == BusFigures(rows=0, missing=0, sync_period=None, sync_jitter=None)
    session.valid[1] = [0x01, 0x02]
    session.valid[2] = [COMPLETE | 0x10, 0x00]
    session.rows = 4
    reader.read()
    reader.read()
    figures = reader.figures()
    assert (figures.rows, figures.missing) == (4, 3)
    assert figures.sync_period == pytest.approx(0.01)
    assert figures.sync_jitter == pytest.approx(0.0, abs=1e-9)


def test_the_period_is_that_of_the_newest_five_thousand_steps(session, reader):
    session.rows = 6000
    reader.read()
    assert len(reader._steps) == 5000


class Ramp:
    """Expects a current that grows with the cycles of the plan, and remembers how often it was asked."""

    def __init__(self) -> None:
        self.asked: list[int] = []

    def at(self, cycles: np.ndarray) -> np.ndarray:
        self.asked.append(len(cycles))
        return np.column_stack([cycles, -2.0 * cycles])


def test_the_expected_current_is_that_of_the_plans_own_cycle_and_only_while_the_plan_is_driven(
    session, reader
):
    reader._expectation = Ramp()
    session.rows = 6
    _, signals, _ = reader.read()
    np.testing.assert_array_equal(signals["predicted 1"], [np.nan, np.nan, np.nan, 0.0, -2.0, -4.0])
    assert signals["setpoint 0"] == pytest.approx(signals["position 0"] + np.full(6, 0.5))
    assert signals["temperature 0"] == [40.0] * 6


def test_a_model_is_asked_at_no_more_instants_than_are_drawn(session, reader):
    ramp = reader._expectation = Ramp()
    session.rows = 5003
    _, signals, _ = reader.read()
    assert ramp.asked[0] <= live_feed.ROWS_OF_BLOCK + 25
    assert signals["predicted 0"][-300] == pytest.approx(4700.0)
