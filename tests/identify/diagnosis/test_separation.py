"""What two rivals part by, and what the diagnosis makes of it: algebra and formulas against drawn numbers."""

from __future__ import annotations

import numpy as np
import pytest

from identify.diagnosis.held_out import HeldOut
from identify.diagnosis.probability import shares
from identify.diagnosis.separation import Apart, expected_share, unfollowed


def test_the_expected_share_of_the_right_rival_is_that_of_its_odds_drawn():
    """Two models of like evidence: the logarithm of their odds has the mean d²/2 and the variance 2 d²."""
    assert expected_share(Apart(0.0)) == pytest.approx(0.5)
    drawn = np.random.default_rng(1).standard_normal(400_000)
    for separation in (0.5, 2.0, 5.0):
        odds = separation**2 / 2 + np.sqrt(2) * separation * drawn
        assert expected_share(Apart(separation)) == pytest.approx(np.mean(1 / (1 + np.exp(-odds))), abs=2e-3)
    assert expected_share(Apart(118.0)) == pytest.approx(1.0)


def left_out(y: np.ndarray, columns: np.ndarray, folds: np.ndarray) -> HeldOut:
    """Squared errors of a least-squares fit on each fold that it did not see."""
    errors = []
    for fold in range(10):
        seen = folds != fold
        chi = np.linalg.lstsq(columns[seen], y[seen], rcond=None)[0] if columns.shape[1] else np.zeros(0)
        errors.append(np.sum((y[~seen] - columns[~seen] @ chi) ** 2))
    return HeldOut(sum(errors), np.array(errors), np.zeros(10), 0)


@pytest.mark.parametrize(
    ("so_far", "more", "further"), [(0.0, 1.0, 1), (1.0, 1.0, 1), (1.0, 4.0, 1), (2.5, 3.0, 1), (0.5, 5.0, 3)]
)
def test_what_a_special_case_and_the_wider_rival_can_expect_is_what_unseen_motion_gives_them(
    so_far, more, further
):
    """Models fitted and left out by hand, weighed as the diagnosis does. The data so far give the first further parameter so
    many deviations and the others what noise does; it is then measured again, `more` as precisely, and what it may be follows
    from the data so far. Either of the two is right as probably as the data so far make it."""
    random = np.random.default_rng(3)
    first, second = 200, 200 if more > 1 else 0
    folds = np.concatenate([np.arange(first) * 10 // first, np.arange(second) * 10 // max(second, 1)])

    def share_of_the_wider(value: float) -> float:
        old = np.linalg.qr(random.standard_normal((first, further)))[0]
        new = np.linalg.qr(random.standard_normal((max(second, further), further)))[0][:second]
        noise = random.standard_normal(first)
        y = noise + old[:, 0] * (so_far - old[:, 0] @ noise)
        columns = np.vstack([old, np.sqrt(more**2 - 1) * new])
        y = np.append(y, columns[first:, 0] * value + random.standard_normal(second))
        models = [left_out(y, columns, folds), left_out(y, columns[:, :0], folds)]
        return float(shares(models, len(y))[0])

    drawn = 120
    wide = np.mean([share_of_the_wider(so_far + random.standard_normal()) for _ in range(drawn)])
    narrow = 1 - np.mean([share_of_the_wider(0.0) for _ in range(drawn)])
    apart = Apart.of_a_wider(so_far, more, further)
    right = expected_share(Apart.of_a_wider(so_far, 1.0, further))
    prior = 0.5 + np.sign(so_far**2 + further - 1 - 2 * further) * np.sqrt(max(0.0, right / 2 - 0.25))
    assert expected_share(apart) == pytest.approx(prior * wide + (1 - prior) * narrow, abs=0.07)


def test_the_further_parameters_of_a_wider_rival_come_to_more_the_less_is_known_of_them():
    assert Apart.of_a_wider(2.0, 1.0, 1).separation == pytest.approx(2.0)
    drawn = np.random.default_rng(2).normal(
        2.0, 1.0, 200_000
    )  # what the parameter may be, in deviations so far
    noise = np.random.default_rng(4).standard_normal(200_000)
    again = (
        2.0 + 8.0 * (drawn + noise / np.sqrt(8.0))
    ) / 3.0  # of nine times the information, one part is known
    assert Apart.of_a_wider(2.0, 3.0, 1).separation == pytest.approx(np.sqrt(np.mean(again**2)), rel=0.01)


def test_what_columns_leave_of_a_torque_stands_across_them_whatever_their_units():
    random = np.random.default_rng(2)
    columns, torque = random.standard_normal((40, 3)) * [1.0, 1e-9, 1e9], random.standard_normal(40)
    columns = np.column_stack([columns, np.zeros(40), 2.0 * columns[:, 0]])
    left = unfollowed(torque, columns)
    size = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    np.testing.assert_allclose(columns.T @ left / size, 0.0, atol=1e-12)
    assert np.linalg.norm(unfollowed(columns[:, 0], columns)) < 1e-12
