"""Friction of link files: the coefficients themselves where a file has a place for them, else the least squares fit."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from identify.export.exported_model import Torque
from identify.export.joint_friction import joint_parts
from identify.export.record_error import Motion
from identify.recording import Payload

BARE = Payload(name="none", mass=0.0)
VISCOUS = Torque("viscous", 0, 0, ("dq",), (3.0,), rubs=True, place="damping")
DRY = Torque("coulomb", 0, 0, ("direction",), (2.0,), rubs=True, place="dry")
OFFSET = Torque("offset", 0, 0, ("1",), (5.0,), place="constant")
DRAG = Torque("viscous-cubic", 0, 0, ("dq**3",), (0.4,), rubs=True)


def spring(stiffness: float) -> Torque:
    return Torque("joint-spring", 0, 0, ("q",), (stiffness,), place="stiffness")


@pytest.fixture(scope="module")
def motions() -> list[Motion]:
    random = np.random.default_rng(3)
    made = []
    for _ in range(2):
        q, dq = random.uniform(-1, 1, (200, 1)), random.uniform(-2, 2, (200, 1))
        made.append(Motion(np.arange(200.0), q, dq, np.zeros_like(q), None, BARE))
    return made


def part_of(torques, kind, motions, torque_of, lost=()):
    model = SimpleNamespace(joints=1, torques=torques, lost=lost, standard=np.array([*np.zeros(10), 0.7]))
    (part,) = joint_parts(model, kind, motions, torque_of)  # type: ignore[arg-type]
    return part


def unasked(motion: Motion) -> np.ndarray:
    return np.full(motion.q.shape, 1e9)


@pytest.mark.parametrize(("kind", "rotor"), [("urdf", 0.0), ("sdf", 0.0), ("xml", 0.7)])
def test_damping_and_dry_friction_stand_as_they_are_and_the_rotor_where_it_has_a_place(motions, kind, rotor):
    part = part_of([VISCOUS, DRY, OFFSET], kind, motions, unasked, [("elasticity", 0), ("delay", 1)])
    assert (part.friction.damping, part.friction.dry, part.friction.rotor) == (3.0, 2.0, rotor)
    has_a_bias = kind == "xml"  # of the joint's actuator
    assert part.friction.constant == (5.0 if has_a_bias else 0.0)
    assert part.kept[1:] == ("viscous", "coulomb", *(["offset"] if has_a_bias else []))
    assert part.approximated == ()
    assert part.lost == (*([] if has_a_bias else ["offset"]), "elasticity")  # the delay is another joint's


@pytest.mark.parametrize(
    ("kind", "stiffness", "kept"),
    [("urdf", 4.0, False), ("sdf", 4.0, True), ("sdf", -4.0, False), ("xml", -4.0, True)],
)
def test_a_spring_stands_where_the_format_has_a_place_and_its_readers_take_it(motions, kind, stiffness, kept):
    part = part_of([VISCOUS, spring(stiffness)], kind, motions, unasked)
    assert part.friction.stiffness == (stiffness if kept else 0.0)
    assert ("joint-spring" in part.kept) is kept
    assert ("joint-spring" in part.lost) is not kept


def test_friction_without_a_place_is_fitted_together_with_what_has_one(motions):
    """The fit is the torque's, less the spring beside it; a constant is nobody's friction."""
    part = part_of(
        [VISCOUS, DRY, DRAG, spring(4.0)],
        "sdf",
        motions,
        lambda motion: 1.5 * motion.dq + 0.25 * np.sign(motion.dq) + 4.0 * motion.q - 6.0,
    )
    assert part.friction.damping == pytest.approx(1.5)
    assert part.friction.dry == pytest.approx(0.25)
    assert part.friction.stiffness == 4.0
    assert part.approximated == ("viscous-cubic", "viscous", "coulomb")
    assert part.kept[1:] == ("joint-spring",)


def test_friction_that_differs_between_the_directions_is_a_constant_where_there_is_one(motions):
    """5 N m of offset, 3 N m forwards and 1 N m backwards: dry friction of 2 N m and 1 N m more of the constant."""
    forwards = Torque("coulomb-asymmetric", 0, 0, ("max(0.0, direction)",), (1.0,), rubs=True)

    def torque(motion: Motion) -> np.ndarray:
        return np.where(motion.dq > 0, 3.0, -1.0) + 5.0

    part = part_of([DRY, OFFSET, forwards], "xml", motions, torque)
    assert (part.friction.dry, part.friction.constant) == pytest.approx((2.0, 6.0))
    assert part.kept[1:] == ("offset",)
    assert part_of([DRY, OFFSET, forwards], "sdf", motions, torque).friction.constant == 0.0


def test_a_polynomial_is_taken_only_where_it_leaves_clearly_less(motions):
    def curved(motion: Motion) -> np.ndarray:
        return 1.5 * motion.dq + 0.3 * np.abs(motion.dq) * motion.dq + 0.4 * motion.dq**3

    fitted = part_of([VISCOUS, DRAG], "xml", motions, curved).friction
    assert (fitted.damping, fitted.quadratic, fitted.cubic) == pytest.approx((1.5, 0.3, 0.4))
    straight = part_of([VISCOUS, DRAG], "xml", motions, lambda motion: 1.5 * motion.dq).friction
    assert (straight.damping, straight.quadratic, straight.cubic) == pytest.approx((1.5, 0.0, 0.0))
    assert part_of([VISCOUS, DRAG], "urdf", motions, curved).friction.cubic == 0.0


def test_no_coefficient_of_friction_is_below_zero(motions):
    driving = Torque("viscous", 0, 0, ("dq",), (-3.0,), rubs=True, place="damping")
    part = part_of([driving], "urdf", motions, lambda motion: -3.0 * motion.dq)
    assert part.friction.damping == 0.0
    assert part.friction.dry == 0.0
    assert part.approximated == ("viscous",)
