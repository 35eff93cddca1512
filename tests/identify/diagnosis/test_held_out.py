"""Errors on motion left out, and their evidence, against plain refits and Monte Carlo."""

from __future__ import annotations

import gc
import weakref
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.diagnosis.evidence import group_evidence
from identify.diagnosis.held_out import FoldedProducts, Trial
from identify.estimation.observation import Observation, TimeBlock
from identify.estimation.triangular_factor import TriangularFactor


def observed(columns: np.ndarray, target: np.ndarray, blocks: int) -> Observation:
    """An observation of one joint and one session, all columns base columns."""
    width = columns.shape[1]
    pieces = np.array_split(np.column_stack([columns, target, target]), blocks)
    return Observation(
        entries=[SimpleNamespace(file="session")],  # type: ignore[list-item]
        base=width,
        slots=[],
        slot_columns=[],
        joint_columns=[np.arange(width)],
        blocks=[TimeBlock(0, float(i), float(i + 1)) for i in range(blocks)],
        factors=[[TriangularFactor.of(piece)] for piece in pieces],
    )


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), base=st.integers(1, 4), variants=st.integers(1, 3))
def test_the_held_out_error_is_that_of_a_refit_without_the_fold(seed, base, variants):
    random = np.random.default_rng(seed)
    width = base + 2 * variants
    columns = random.standard_normal((400, width)) @ random.standard_normal((width, width))
    target = columns @ random.standard_normal(width) + random.standard_normal(400)
    observation = observed(columns, target, 20)
    folds = np.arange(20) // 4
    trial = Trial(tuple(np.arange(base + 2 * v, base + 2 * v + 2) for v in range(variants)))
    found = FoldedProducts(observation, np.ones(1), folds).evaluate(0, np.arange(base), [trial])[0]
    rows = np.array_split(np.arange(400), 20)
    for fold in range(5):
        test = np.concatenate([rows[b] for b in range(20) if folds[b] == fold])
        train = np.setdiff1d(np.arange(400), test)
        errors = []
        for option in trial.variants:
            kept = np.concatenate([np.arange(base), option])
            fit = np.linalg.lstsq(columns[np.ix_(train, kept)], target[train], rcond=None)[0]
            on_train = np.sum((target[train] - columns[np.ix_(train, kept)] @ fit) ** 2)
            on_test = np.sum((target[test] - columns[np.ix_(test, kept)] @ fit) ** 2)
            errors.append((on_train, on_test))
        assert found.fold[fold] == pytest.approx(min(errors)[1], rel=1e-5)


def test_products_go_with_the_last_who_asks_for_them():
    """They are the largest that a round of a search holds, and would stay until Python looks for objects that refer to each
    other."""
    random = np.random.default_rng(3)
    products = FoldedProducts(
        observed(random.standard_normal((60, 3)), random.standard_normal(60), 6),
        np.ones(1),
        np.arange(6) // 2,
    )
    gc.disable()
    try:
        products.evaluate(0, np.arange(2), [Trial((np.array([2]),))])
        left = weakref.ref(products)
        del products
        assert left() is None
    finally:
        gc.enable()


def coloured(random: np.random.Generator, count: int, memory: float) -> np.ndarray:
    noise = random.standard_normal(count)
    for k in range(1, count):
        noise[k] = memory * noise[k - 1] + np.sqrt(1 - memory**2) * noise[k]
    return noise


def test_the_evidence_cries_wolf_no_more_often_than_it_says_under_coloured_noise():
    random = np.random.default_rng(5)
    count, alarms, tries = 2000, 0, 200
    for _ in range(tries):
        columns = np.column_stack(
            [np.ones(count), coloured(random, count, 0.95), coloured(random, count, 0.95)]
        )
        observation = observed(columns, coloured(random, count, 0.8), 60)
        alarms += group_evidence(observation, 0, np.arange(2), np.array([2]))[0] < 0.05
    assert alarms <= 0.09 * tries  # three standard deviations of a binomial above 5 %


def test_the_evidence_sees_what_is_there():
    random = np.random.default_rng(6)
    columns = np.column_stack([np.ones(2000), coloured(random, 2000, 0.95), coloured(random, 2000, 0.95)])
    target = 0.3 * columns[:, 2] + coloured(random, 2000, 0.8)
    assert group_evidence(observed(columns, target, 60), 0, np.arange(2), np.array([2]))[0] < 1e-4


def test_the_evidence_takes_no_rounding_for_an_effect():
    """A column that is another but for its last digits carries nothing, however well those digits seem to fit."""
    random = np.random.default_rng(7)
    for _ in range(20):
        known = coloured(random, 2000, 0.95)
        twin = known * (1 + 1e-8 * random.standard_normal(2000))
        columns = np.column_stack([np.ones(2000), known, twin])
        observation = observed(columns, known + coloured(random, 2000, 0.8), 60)
        assert group_evidence(observation, 0, np.arange(2), np.array([2]))[0] == 1.0


def test_what_all_the_data_say_of_an_effect_stands_in_where_a_fold_left_out_leaves_nothing_that_tells():
    """Two sessions, and an effect that only their difference tells: each alone is no prediction of the other."""
    random = np.random.default_rng(8)
    count, load = 1000, np.repeat([1.0, 4.0], 1000)
    motion = random.standard_normal(2 * count)
    columns = np.column_stack([motion, motion * load + 3e-3 * random.standard_normal(2 * count)])
    target = columns @ [1.0, 0.5] + 0.1 * random.standard_normal(2 * count)
    observation, folds = observed(columns, target, 20), np.arange(20) // 10
    trials = [Trial((np.array([], np.intp),)), Trial((np.array([1]),))]
    without, alone = FoldedProducts(observation, np.ones(1), folds).evaluate(0, np.array([0]), trials)
    assert alone.total > without.total
    _, aided = FoldedProducts(observation, np.ones(1), folds, 0.05).evaluate(0, np.array([0]), trials)
    assert aided.total < 0.1 * without.total


def test_the_model_too_is_told_a_little_of_a_session_left_out():
    """Two parameters of the model that only the difference of two sessions tells, and an effect that both tell."""
    random = np.random.default_rng(10)
    count, load = 1000, np.repeat([1.0, 4.0], 1000)
    motion = random.standard_normal(2 * count)
    other = motion * load + 3e-3 * random.standard_normal(2 * count)
    columns = np.column_stack([motion, other, random.standard_normal(2 * count)])
    target = columns @ [1.0, 0.5, 0.3] + 0.1 * random.standard_normal(2 * count)
    observation, folds, base = observed(columns, target, 20), np.arange(20) // 10, np.arange(2)
    noise = 0.1**2 * 2 * count
    wholly = FoldedProducts(observation, np.ones(1), folds)
    assert wholly.alone(0, base).total > 10 * noise
    aided = FoldedProducts(observation, np.ones(1), folds, 0.05)
    assert aided.alone(0, base).total == pytest.approx((0.3**2 + 0.1**2) * 2 * count, rel=0.1)
    (with_effect,) = aided.evaluate(0, base, [Trial((np.array([2]),))])
    assert with_effect.total == pytest.approx(noise, rel=0.1)


def test_of_choices_with_more_or_fewer_columns_the_narrow_one_is_taken_where_the_others_fit_noise():
    """Thirteen columns always fit more than the three that they contain; on unseen motion they cost."""
    random = np.random.default_rng(9)
    narrow = 0
    for _ in range(20):
        columns = random.standard_normal((400, 14))
        observation = observed(columns, columns[:, :4] @ np.ones(4) + 3 * random.standard_normal(400), 40)
        trial = Trial((np.arange(1, 4), np.arange(1, 14)))
        (fared,) = FoldedProducts(observation, np.ones(1), np.arange(40) // 4).evaluate(
            0, np.array([0]), [trial]
        )
        narrow += fared.variant == 0
    assert narrow >= 19
    wide = observed(columns, columns @ np.ones(14) + random.standard_normal(400), 40)
    (fared,) = FoldedProducts(wide, np.ones(1), np.arange(40) // 4).evaluate(0, np.array([0]), [trial])
    assert fared.variant == 1
