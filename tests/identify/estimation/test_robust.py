"""Huber's estimate beside a general minimiser of Huber's loss on the same rows, and its deviations beside closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares as minimised
from scipy.stats import norm

from identify.estimation.decimated_rows import decimated_rows
from identify.estimation.estimate import Estimate
from identify.estimation.fitted_model import FittedModel
from identify.estimation.fitting import fit_model
from identify.estimation.requested_model import open_record, requested_model
from identify.estimation.robust import MEDIAN_OF_NORMAL, THRESHOLD, huber
from tests.identify.estimation import simulated_arm


def fitted_arm(outliers: float) -> FittedModel:
    random = np.random.default_rng(5)
    raw = simulated_arm.record(
        simulated_arm.Motion(), simulated_arm.Arm(), random, duration=10.0, torque_noise=2.0
    )
    if outliers:
        raw = simulated_arm.with_outliers(raw, random, share=outliers, size=300.0)
    record = open_record(simulated_arm.experiment({"a": (raw, "none")}))
    return fit_model(record, requested_model(record, "usual"))


def huber_of(fitted: FittedModel) -> Estimate:
    return huber(
        fitted.record, fitted.entries, fitted.slots, fitted.load_from, fitted.observation, fitted.fit
    )


def moving_rows(fitted: FittedModel) -> tuple[np.ndarray, np.ndarray]:
    """W and Y of the joint where it moves."""
    blocks = decimated_rows(fitted.record, fitted.entries[0], list(fitted.slots), fitted.load_from)
    rows = np.vstack([block.rows[0][block.moving[:, 0]] for block in blocks])
    return rows[:, :-2], rows[:, -2]


@pytest.fixture(scope="module")
def with_outliers() -> FittedModel:
    return fitted_arm(0.08)


def test_the_estimate_minimises_hubers_loss_with_the_scale_of_its_own_residuals(with_outliers):
    estimate = huber_of(with_outliers)
    columns, measured = moving_rows(with_outliers)
    chi = estimate.fit.chi[with_outliers.observation.joint_columns[0]]
    residual = measured - columns @ chi
    scale = np.median(np.abs(residual)) / MEDIAN_OF_NORMAL
    size = np.linalg.norm(columns, axis=0)
    other = minimised(
        lambda x: measured - columns @ (x / size),
        np.zeros(len(chi)),
        jac=lambda _: -columns / size,
        loss="huber",
        f_scale=THRESHOLD * scale,
        xtol=1e-12,
        ftol=1e-14,
        gtol=1e-10,
    )
    moved = columns @ (chi - other.x / size)
    assert np.linalg.norm(moved) < 1e-3 * np.linalg.norm(residual)
    outlying = np.mean(np.abs(residual) > THRESHOLD * scale)
    assert f"{100 * outlying:.1f} % of the samples counted less" in estimate.remarks[0]
    least = with_outliers.fit.chi[with_outliers.observation.joint_columns[0]]
    assert np.linalg.norm(columns @ (chi - least)) > 0.05 * np.linalg.norm(residual), (
        "outliers moved the other"
    )


def test_the_deviations_are_hubers_with_his_correction_for_the_parameters(with_outliers):
    """Huber 1981, eq. 7.6.5: K² Σ ψ² / (n - p) / m² (WᵀW)⁻¹, K = 1 + p / n (1 - m) / m, m the part of samples inside."""
    columns, measured = moving_rows(with_outliers)
    estimate, place = huber_of(with_outliers), with_outliers.observation.joint_columns[0]
    residual = measured - columns @ estimate.fit.chi[place]
    scale = np.median(np.abs(residual)) / MEDIAN_OF_NORMAL
    n, p = columns.shape
    m = np.mean(np.abs(residual) <= THRESHOLD * scale)
    scores = np.clip(residual, -THRESHOLD * scale, THRESHOLD * scale)
    correction = 1 + p / n * (1 - m) / m
    assert correction > 1.001
    variance = correction**2 * np.sum(scores**2) / (n - p) / m**2
    size = np.linalg.norm(columns, axis=0)
    inverse = np.linalg.inv((columns / size).T @ (columns / size))
    np.testing.assert_allclose(
        estimate.std[place], np.sqrt(variance * np.diag(inverse)) / size, rtol=0.2 * (correction - 1)
    )


def test_where_the_noise_is_normal_the_deviations_are_those_of_least_squares_over_the_efficiency():
    """Huber 1964: the variance is E ψ² / (E ψ')², which for normal noise is 1 / 0.95 of least squares'."""
    fitted = fitted_arm(0.0)
    columns, measured = moving_rows(fitted)
    estimate = huber_of(fitted)
    chi = estimate.fit.chi[fitted.observation.joint_columns[0]]
    residual = measured - columns @ chi
    c, inside = THRESHOLD, 2 * norm.cdf(THRESHOLD) - 1
    squares = inside - 2 * c * norm.pdf(c) + 2 * c**2 * norm.sf(c)
    assert inside**2 / squares == pytest.approx(0.95, abs=1e-3)
    freedom = len(measured) - len(chi)
    covariance = np.linalg.inv(columns.T @ columns) * (residual @ residual) / freedom * squares / inside**2
    stated = estimate.std[fitted.observation.joint_columns[0]]
    np.testing.assert_allclose(stated, np.sqrt(np.diag(covariance)), rtol=0.12)
