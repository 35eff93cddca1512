"""A fitted torque beside another: the same or not, and half way between."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest

import identify
from identify.effects.catalogue import effects
from identify.effects.model import Term
from identify.estimation.context import FittedTorque, Slot, contexts
from identify.estimation.record import Record

DRY = Slot.of(Term(effects()["coulomb"], 0))
STRIBECK = Term(effects()["stribeck"], 0)


def torque(chi, *factors):
    return FittedTorque(np.array(chi), tuple((slot, np.array(values)) for slot, values in factors))


def test_the_same_effects_with_the_same_values_are_the_same():
    one = torque([1.0, 2.0], (DRY, [0.5]))
    assert one.same_as(torque([1.0, 2.0], (DRY, [0.5])))
    assert not one.same_as(None)
    assert not one.same_as(torque([1.0, 2.1], (DRY, [0.5])))
    assert not one.same_as(torque([1.0, 2.0], (DRY, [0.6])))
    assert not one.same_as(torque([1.0, 2.0]))
    slow, fast = (Slot.of(STRIBECK, {"stribeck_velocity": speed}) for speed in (0.1, 0.2))
    assert not torque([1.0], (slow, [0.5])).same_as(torque([1.0], (fast, [0.5])))


def test_half_way_is_the_mean_of_what_both_have_whatever_their_constants():
    slow, fast = (Slot.of(STRIBECK, {"stribeck_velocity": speed}) for speed in (0.1, 0.2))
    new = torque([2.0, 4.0], (fast, [1.0]), (DRY, [3.0]))
    mean = new.half_way_from(torque([0.0, 2.0], (slow, [0.0])))
    assert mean.chi == pytest.approx([1.0, 3.0])
    assert [slot for slot, _ in mean.factors] == [fast, DRY]
    assert [float(values[0]) for _, values in mean.factors] == [0.5, 3.0]


def test_what_the_columns_of_a_block_were_made_of_goes_with_the_pass(three_sessions):
    """It is as large as the block, and would stay until Python looks for objects that refer to each other."""
    record = Record.of(identify.load_experiment(three_sessions))
    entry = record.entries()[0]
    gc.disable()
    try:
        left = []
        for context in contexts(record, entry, None):
            assert context.columns(DRY, 0).shape == (len(context.block.time), 1)
            left.append(weakref.ref(context))
        del context
        assert left
        assert not any(reference() for reference in left)
    finally:
        gc.enable()
