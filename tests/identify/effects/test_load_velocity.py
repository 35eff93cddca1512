"""The columns of eq. (30), against the equation written out sample by sample."""

from types import SimpleNamespace

import numpy as np

from identify.effects.load_velocity import GearFriction, LoadVelocity, linear_names

SAMPLES, BASE = 60, 3
RANDOM = np.random.default_rng(5)


def motion():
    inertial = RANDOM.normal(size=(SAMPLES, BASE))
    known = RANDOM.normal(size=SAMPLES)
    dq = RANDOM.normal(size=SAMPLES)
    load = inertial @ [2.0, -1.0, 0.5] + known
    return SimpleNamespace(inertial=inertial, known_load=known, load=load, dq=dq, direction=np.sign(dq))


def torque(moved, a_m, b_m, a_g, b_g, c_m, d_m, c_g, d_g, stribeck_velocity):
    """Eq. (25), one sample after the other."""
    values = []
    for load, dq in zip(moved.load, moved.dq, strict=True):
        e = np.exp(-abs(dq) / stribeck_velocity)
        if load * dq > 0:
            values.append((a_m + b_m * e) * load + (c_m + d_m * e) * np.sign(dq))
        else:
            values.append((a_g - b_g * e) * load + (c_g + d_g * e) * np.sign(dq))
    return np.array(values)


GEAR = {"a_m": 1.04, "b_m": 0.14, "a_g": 0.96, "b_g": 0.16, "c_m": 21.0, "d_m": 2.0, "c_g": 15.0, "d_g": 1.0}


def test_the_columns_times_the_products_of_eq_43_are_the_torque_of_eq_25():
    moved = motion()
    arm = np.array([2.0, -1.0, 0.5, 1.0])  # the last is the known load's own factor
    chi = np.concatenate(
        [
            *(GEAR[name] * arm for name in ("a_m", "b_m", "a_g", "b_g")),
            [GEAR[n] for n in ("c_m", "d_m", "c_g", "d_g")],
        ]
    )
    columns = LoadVelocity().columns(moved, {"stribeck_velocity": 0.4})
    np.testing.assert_allclose(columns @ chi, torque(moved, **GEAR, stribeck_velocity=0.4), rtol=1e-12)


def test_with_the_load_as_one_the_eight_columns_have_the_gear_s_own_parameters():
    moved = motion()
    columns = GearFriction().columns(moved, {"stribeck_velocity": 0.2})
    assert columns.shape == (SAMPLES, 8)
    np.testing.assert_allclose(
        columns @ list(GEAR.values()), torque(moved, **GEAR, stribeck_velocity=0.2), rtol=1e-12
    )


def test_the_names_are_in_the_order_of_the_columns():
    names = linear_names(["J", "MX"], ["kg m^2", "kg m"])
    assert [name for name, _ in names] == [
        *("a_m·J", "a_m·MX", "a_m", "b_m·J", "b_m·MX", "b_m"),
        *("a_g·J", "a_g·MX", "a_g", "b_g·J", "b_g·MX", "b_g"),
        *("c_m", "d_m", "c_g", "d_g"),
    ]
    assert dict(names)["b_g·MX"] == "kg m"
    assert dict(names)["a_m"] == "1"
