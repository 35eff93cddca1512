"""Robots whose equations stand in books: one joint (eq. 31), a horizontal slide, two links in a plane."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identify.dynamics.base_parameters import base_parameters
from identify.dynamics.geometry import Geometry
from identify.dynamics.payload import payload_torque
from identify.dynamics.regressor import standard_regressor
from identify.dynamics.standard_parameters import standard_names, standard_units
from tests.identify.dynamics.random_robots import geometry_of, random_motion, robot

G = 9.81
RX130L_JOINT_3 = geometry_of((0.0, -G, 0.0), [("revolute", 0.0, 0.0, 0.0, 0.0)])
HORIZONTAL_SLIDE = geometry_of((0.0, -G, 0.0), [("prismatic", 0.0, 0.0, 0.0, 0.0)])
UPPER_ARM = 0.7
TWO_LINKS = geometry_of(
    (0.0, -G, 0.0), [("revolute", 0.0, 0.0, 0.0, 0.0), ("revolute", 0.0, UPPER_ARM, 0.0, 0.0)]
)


def test_the_papers_arm_has_the_base_parameters_of_eq_31():
    base = base_parameters(RX130L_JOINT_3)
    assert base.names == ("ZZ1R", "MX1", "MY1")
    assert base.groupings == ("ZZ1 + Ia1", "MX1", "MY1")
    assert base.units == ("kg m^2", "kg m", "kg m")
    assert base.joints == ("joint1",) * 3


def test_the_papers_arm_obeys_eq_31():
    q, dq, ddq = random_motion(3, 50, 1)
    columns = base_parameters(RX130L_JOINT_3).columns(q, dq, ddq)
    # gravity along -y: MX g cos q holds the arm up; the paper writes + MY g sin q, its y the other way
    expected = np.stack([ddq, G * np.cos(q), -G * np.sin(q)], axis=-1)
    np.testing.assert_allclose(columns, expected, rtol=0, atol=1e-12)


def test_a_payload_on_the_papers_arm_obeys_eq_34():
    q, dq, ddq = random_motion(4, 50, 1)
    mass, lever, radius, thickness = 6.970, 1.277, 0.08, 0.05
    disk = mass * (radius**2 / 4 + thickness**2 / 12)
    payload = SimpleNamespace(
        mass=mass, com=[lever, 0.0, 0.0], inertia=[mass * radius**2 / 2, 0.0, 0.0, disk, 0.0, disk]
    )
    expected = mass * lever * (lever * ddq + G * np.cos(q)) + disk * ddq
    np.testing.assert_allclose(
        payload_torque(RX130L_JOINT_3, payload, q, dq, ddq), expected, rtol=0, atol=1e-10
    )


def test_no_payload_makes_no_torque():
    payload = SimpleNamespace(mass=0.0, com=[0.0, 0.0, 0.0], inertia=[0.0] * 6)
    torque = payload_torque(TWO_LINKS, payload, *random_motion(5, 4, 2))
    assert torque.shape == (4, 2)
    assert not torque.any()


def test_a_horizontal_slide_is_one_mass():
    base = base_parameters(HORIZONTAL_SLIDE)
    assert (base.names, base.groupings, base.units) == (("M1R",), ("M1 + Ia1",), ("kg",))
    q, dq, ddq = random_motion(6, 9, 1)
    np.testing.assert_allclose(base.columns(q, dq, ddq)[:, :, 0], ddq, rtol=1e-15)


def test_a_vertical_slide_tells_its_rotor_from_its_mass():
    base = base_parameters(geometry_of((0.0, 0.0, -G), [("prismatic", 0.0, 0.0, 0.0, 0.0)]))
    assert base.names == ("M1", "Ia1")
    assert base.units == ("kg", "kg")


def test_two_links_in_a_vertical_plane_have_the_books_base_parameters():
    base = base_parameters(TWO_LINKS)
    square = UPPER_ARM**2
    assert dict(zip(base.names, base.groupings, strict=True)) == {
        "ZZ1R": f"ZZ1 + Ia1 + {square:.6g} M2",
        "MX1R": f"MX1 + {UPPER_ARM:.6g} M2",
        "MY1": "MY1",
        "ZZ2": "ZZ2",
        "MX2": "MX2",
        "MY2": "MY2",
        "Ia2": "Ia2",
    }
    assert list(base.acts_on(1)) == [False, False, False, True, True, True, True]


def test_a_torque_measured_behind_the_rotors_has_the_same_parameters_without_them():
    base = base_parameters(TWO_LINKS, rotors=False)
    whole = base_parameters(TWO_LINKS)
    assert base.names == tuple(name for name in whole.names if name != "Ia2")
    assert base.groupings[0] == f"ZZ1 + {UPPER_ARM**2:.6g} M2"
    assert not any("Ia" in grouping for grouping in base.groupings)


def test_two_links_in_a_vertical_plane_obey_the_books_equations():
    """Lagrange's equations of two point masses at the ends of two rods, written out by hand."""
    first_mass, second_mass, first, second = 3.0, 2.0, UPPER_ARM, 0.4
    standard = np.zeros(22)
    names = standard_names(TWO_LINKS)
    for name, value in {
        "ZZ1": first_mass * first**2,
        "MX1": first_mass * first,
        "M1": first_mass,
        "ZZ2": second_mass * second**2,
        "MX2": second_mass * second,
        "M2": second_mass,
    }.items():
        standard[names.index(name)] = value
    q, dq, ddq = random_motion(7, 30, 2)
    (q1, q2), (v1, v2), (a1, a2) = q.T, dq.T, ddq.T
    coupling = second_mass * first * second
    inertia = second_mass * second**2
    torque_1 = (
        ((first_mass + second_mass) * first**2 + inertia + 2 * coupling * np.cos(q2)) * a1
        + (inertia + coupling * np.cos(q2)) * a2
        - coupling * np.sin(q2) * (2 * v1 * v2 + v2**2)
        + (first_mass + second_mass) * G * first * np.cos(q1)
        + second_mass * G * second * np.cos(q1 + q2)
    )
    torque_2 = (
        (inertia + coupling * np.cos(q2)) * a1
        + inertia * a2
        + coupling * np.sin(q2) * v1**2
        + second_mass * G * second * np.cos(q1 + q2)
    )
    base = base_parameters(TWO_LINKS)
    expected = np.column_stack([torque_1, torque_2])
    np.testing.assert_allclose(
        base.columns(q, dq, ddq) @ base.from_standard(standard), expected, rtol=0, atol=1e-10
    )


def test_a_first_axis_along_gravity_groups_its_rotor_and_the_next_links_yy_into_zz1():
    """A vertical axis, then one square to it: the first rules of W. Khalil and E. Dombre's direct method."""
    joints = [("revolute", 0.0, 0.0, 0.0, 0.0), ("revolute", np.pi / 2, 0.0, 0.0, 0.0)]
    base = base_parameters(geometry_of((0.0, 0.0, -G), joints))
    assert dict(zip(base.names, base.groupings, strict=True)) == {
        "ZZ1R": "ZZ1 + Ia1 + YY2",
        "XX2R": "XX2 - YY2",
        "XY2": "XY2",
        "XZ2": "XZ2",
        "YZ2": "YZ2",
        "ZZ2R": "ZZ2 + Ia2",
        "MX2": "MX2",
        "MY2": "MY2",
    }


def test_angles_as_people_type_them_count_as_right_angles():
    joints = [("revolute", 0.0, 0.0, 3.1416, 0.0), ("revolute", 1.5708, 0.0, 0.0, 0.0)]
    typed = geometry_of((0.0, 0.0, -G), joints)
    assert typed.alpha[1] == np.pi / 2
    assert typed.theta[0] == np.pi
    really_tilted = geometry_of((0.0, 0.0, -G), [("revolute", 1.57, 0.0, 0.0, 0.0)])
    assert really_tilted.alpha[0] == 1.57


def test_the_same_robot_gives_the_same_base_parameters():
    description = robot((0.0, 0.0, -G), [("revolute", 0.3 * k, 0.1, 0.0, 0.05) for k in range(5)])
    first, second = (base_parameters(Geometry.from_robot(description)) for _ in range(2))
    assert first.groupings == second.groupings
    assert np.array_equal(first.matrix, second.matrix)


def test_standard_parameters_stand_in_the_papers_order():
    paper = "XX1 XY1 XZ1 YY1 YZ1 ZZ1 MX1 MY1 MZ1 M1 Ia1"
    assert " ".join(standard_names(RX130L_JOINT_3)) == paper
    assert standard_units(HORIZONTAL_SLIDE)[-2:] == ("kg", "kg")


def test_motion_of_the_wrong_shape_is_refused():
    with pytest.raises(ValueError, match=r"must be \(4, 2\)"):
        standard_regressor(TWO_LINKS, np.zeros((4, 2)), np.zeros((4, 3)), np.zeros((4, 2)))


def test_a_link_makes_no_torque_on_the_joints_beyond_it():
    base = base_parameters(TWO_LINKS)
    everything = replace(base, acts=np.ones_like(base.acts))
    columns = everything.joint_columns(1, *random_motion(8, 6, 2))
    assert not columns[:, :3].any()
    assert columns[:, 3:].any(axis=0).all()


def test_standard_parameters_near_a_drawing_have_the_identified_base_parameters():
    base = base_parameters(TWO_LINKS)
    generator = np.random.default_rng(9)
    drawing, identified = generator.uniform(0.1, 2.0, 22), generator.uniform(0.1, 2.0, len(base))
    found = base.nearest_standard(identified, drawing)
    np.testing.assert_allclose(base.from_standard(found), identified, rtol=1e-12)
    np.testing.assert_allclose(
        base.nearest_standard(base.from_standard(drawing), drawing), drawing, rtol=1e-12
    )
    untouched = ~base.matrix.any(axis=0)
    assert np.array_equal(found[untouched], drawing[untouched])
