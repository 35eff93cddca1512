"""Columns that the record holds between passes are those that a record without them computes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import identify
from identify.effects.catalogue import effects
from identify.effects.model import Term
from identify.estimation import record as records
from identify.estimation.context import FittedTorque, Slot
from identify.estimation.decimated_rows import decimated_rows
from identify.estimation.record import Record


def rows(record: Record, slots: list[Slot], fitted: FittedTorque | None) -> np.ndarray:
    """Decimated rows of all sessions, one below the other."""
    return np.vstack(
        [
            block.rows[0]
            for entry in record.entries()
            for block in decimated_rows(record, entry, slots, fitted)
        ]
    )


@pytest.fixture(scope="module")
def slots(three_sessions) -> list[Slot]:
    """Every effect of the catalogue that the record does not prevent, with all its constants."""
    record = Record.of(identify.load_experiment(three_sessions))
    summary = replace(
        record.summaries[0],
        position_lines=(3.0, 7.0),
        load_lines=(4.0,),
        own_inertia=1.0,
        load_range=(-5.0, 5.0),
    )
    return [
        Slot.of(Term(effect, 0), constants)
        for effect in effects().values()
        if not effect.prevented(summary)
        for constants in effect.grid(summary)
    ]


def fitted(record: Record, scale: float) -> FittedTorque:
    """A load of its own, and some friction."""
    base = np.linspace(1.0, 2.0, len(record.body.base)) * scale
    return FittedTorque(base, ((Slot.of(Term(effects()["coulomb"], 0)), np.array([2.0 * scale])),))


def test_a_second_pass_with_another_fit_is_that_of_a_record_that_holds_nothing(three_sessions, slots):
    held = Record.of(identify.load_experiment(three_sessions))
    first = rows(held, slots, fitted(held, 1.0))
    again = rows(held, slots, fitted(held, 3.0))
    anew = Record.of(identify.load_experiment(three_sessions))
    np.testing.assert_allclose(again, rows(anew, slots, fitted(anew, 3.0)), rtol=1e-12, atol=1e-12)
    assert np.abs(again - first).max() > 0.1  # the load is another one
    assert held._columns


def test_a_record_that_is_too_long_to_be_held_gives_the_same(three_sessions, slots, monkeypatch):
    held = Record.of(identify.load_experiment(three_sessions))
    rows(held, slots, None)
    expected = rows(held, slots, None)
    monkeypatch.setattr(records, "LARGEST_HELD", 0)
    long = Record.of(identify.load_experiment(three_sessions))
    rows(long, slots, None)
    np.testing.assert_allclose(rows(long, slots, None), expected, rtol=1e-12, atol=1e-12)
    assert not long._columns


def test_slots_in_another_order_find_their_own_columns(three_sessions, slots):
    held = Record.of(identify.load_experiment(three_sessions))
    base = len(held.body.base)
    forward = rows(held, slots, None)[:, base:-2]
    backward = rows(held, slots[::-1], None)[:, base:-2]
    np.testing.assert_allclose(np.sort(np.abs(forward).sum(0)), np.sort(np.abs(backward).sum(0)), rtol=1e-12)
