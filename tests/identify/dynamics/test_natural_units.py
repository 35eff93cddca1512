"""Units of mass and length of a machine: another machine of the same shape has them in the ratio of its size."""

from __future__ import annotations

import numpy as np
import pytest

from identify.dynamics.base_parameters import base_parameters
from identify.dynamics.natural_units import NaturalUnits
from tests.identify.dynamics.random_robots import geometry_of

UNITS = {"kg": (1, 0), "kg m": (1, 1), "kg m^2": (1, 2)}


def arm(length):
    return base_parameters(
        geometry_of(
            (0.0, 0.0, -9.81),
            [("revolute", 0.0, 0.0, 0.0, 0.3 * length), ("revolute", -1.5707963, 0.1 * length, 0.0, 0.0)],
        )
    )


def pendulum():
    return base_parameters(geometry_of((0.0, 9.81, 0.0), [("revolute", 0.0, 0.0, 0.0, 0.0)]))


def scaled(base, values, mass, length):
    return np.array([v * mass * length ** UNITS[unit][1] for v, unit in zip(values, base.units, strict=True)])


@pytest.mark.parametrize(("mass", "length"), [(1e-9, 1e-3), (1e8, 50.0), (1.0, 1.0)])
def test_they_grow_with_the_machine(mass, length):
    one, other = arm(1.0), arm(length)
    values = np.linspace(0.2, 2.0, len(one))
    before = NaturalUnits.of_estimate(one, values)
    after = NaturalUnits.of_estimate(other, scaled(other, values, mass, length))
    assert after.length / before.length == pytest.approx(length)
    assert after.mass / before.mass == pytest.approx(mass)


def test_the_length_of_a_single_joint_is_that_of_its_moments():
    """A rod of 2 kg and 0.6 m about its end: m l²/3 over m l/2 is two thirds of its length."""
    base = pendulum()
    rod = {"ZZ1R": 2.0 * 0.6**2 / 3.0, "MX1": 2.0 * 0.3, "MY1": 0.0}
    values = np.array([rod[name] for name in base.names])
    information = np.diag([1.0] * len(base))
    assert NaturalUnits.of_estimate(base, values, information).length == pytest.approx(0.4)


def test_a_parameter_that_the_record_does_not_tell_sets_no_unit():
    base = arm(1.0)
    values = np.ones(len(base))
    plain = NaturalUnits.of_estimate(base, values, np.eye(len(base)))
    values[0] = 1e9
    blind = np.eye(len(base))
    blind[0, 0] = 0.0
    assert NaturalUnits.of_estimate(base, values, blind).mass == pytest.approx(plain.mass, rel=0.5)


def test_units_of_parameters_are_products_of_both():
    base = arm(1.0)
    natural = NaturalUnits(2.0, 3.0)
    size = {"kg": 2.0, "kg m": 6.0, "kg m^2": 18.0}
    np.testing.assert_allclose(natural.of_base(base), [size[unit] for unit in base.units])
    np.testing.assert_allclose(natural.of_standard(base)[:11], [18.0] * 6 + [6.0] * 3 + [2.0, 18.0])


def test_a_machine_without_inertia_has_units():
    assert NaturalUnits.of_estimate(pendulum(), np.zeros(len(pendulum()))) == NaturalUnits(1.0, 1.0)
