"""Instrumental variables: the halves of the samples, the strength of instruments, and the estimate, each in closed form."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from identify.estimation.instrumental_variable import (
    half_of_samples,
    has_reference,
    reference_positions,
    weakest_correlation,
)


def session(position, segments=None, **extra):
    """What is asked of a session."""
    count, n = position.shape
    return SimpleNamespace(position=position, segments=segments or [slice(0, count)], extra=extra, n=n)


@pytest.mark.parametrize("parity", [0, 1])
def test_cubics_come_back_exactly_from_every_other_sample(parity):
    t = np.arange(30.0)
    cubic = np.column_stack([0.01 * t**3 - 0.2 * t**2 + t - 3, 5 - t])
    np.testing.assert_allclose(half_of_samples(session(cubic), parity), cubic, rtol=1e-12, atol=1e-10)


@pytest.mark.parametrize(("parity", "kept"), [(0, 12), (1, 13)])
def test_noise_of_the_samples_left_out_has_no_say_and_the_ends_stay(parity, kept):
    count = 30
    noisy = np.zeros((count, 1))
    other = kept + 1
    noisy[other] = 1.0  # is replaced by what its neighbours say: nothing
    assert np.all(half_of_samples(session(noisy), parity) == 0.0)
    noisy[other], noisy[kept] = 0.0, 16.0
    found = half_of_samples(session(noisy), parity)[:, 0]
    expected = np.zeros(count)
    expected[kept] = 16.0
    expected[[kept - 1, kept + 1]] = 9.0
    expected[[kept - 3, kept + 3]] = -1.0
    np.testing.assert_array_equal(found, expected)
    edges = np.zeros((count, 1))
    edges[[1, 2, -2, -3]] = 7.0
    np.testing.assert_array_equal(half_of_samples(session(edges), parity)[[1, 2, -2, -3], 0], 7.0)


def test_nothing_is_interpolated_from_one_segment_to_the_next():
    position = np.concatenate([np.zeros(12), np.full(12, 100.0)])[:, None]
    cut = session(position, [slice(0, 12), slice(12, 24)])
    np.testing.assert_array_equal(half_of_samples(cut, 0), position)
    assert np.any(half_of_samples(session(position), 0) != position)


def test_the_reference_motion_is_that_of_every_joint_or_none():
    position = np.zeros((4, 2))
    one, two = np.arange(4.0), -np.arange(4.0)
    assert has_reference(session(position, qref1=one, qref2=two))
    assert not has_reference(session(position, qref1=one))
    np.testing.assert_array_equal(
        reference_positions(session(position, qref1=one, qref2=two)), np.column_stack([one, two])
    )


def test_the_weakest_correlation_is_the_cosine_of_the_largest_angle_between_the_planes():
    """Planes e1, e2 and e1, cos a · e2 + sin a · e3; of any bases of them."""
    angle = 1.1
    Z = np.eye(4)[:, :2] @ np.array([[2.0, 1.0], [0.5, 3.0]])
    W = np.column_stack([np.eye(4)[:, 0], np.cos(angle) * np.eye(4)[:, 1] + np.sin(angle) * np.eye(4)[:, 2]])
    W = W @ np.array([[1.0, -2.0], [0.3, 5.0]])
    assert weakest_correlation(Z.T @ W, Z.T @ Z, W.T @ W) == pytest.approx(np.cos(angle))
    assert weakest_correlation(Z.T @ Z, Z.T @ Z, Z.T @ Z) == pytest.approx(1.0)
