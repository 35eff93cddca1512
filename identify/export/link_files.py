"""The robot as simulators take it: URDF, SDF and MJCF. Bodies with mass, joints with what friction the format has."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.geometry import Geometry
from identify.dynamics.rotations import quaternion, roll_pitch_yaw
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Body:
    """A link as the formats describe it, in its own joint's frame at the joint's zero.

    mass    : kg
    centre  : (3,) m
    inertia : (3, 3) kg m² about the centre of mass
    """

    mass: float
    centre: Array
    inertia: Array

    @classmethod
    def of(cls, parameters: Array) -> Body:
        """From XX XY XZ YY YZ ZZ MX MY MZ M of a body with mass."""
        xx, xy, xz, yy, yz, zz, mx, my, mz, mass = (float(value) for value in parameters[:10])
        centre = np.array([mx, my, mz]) / mass
        origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        return cls(mass, centre, origin - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre)))


@dataclass(frozen=True)
class JointFriction:
    """What the formats have for friction and the drive, of one joint.

    damping   : N m s/rad or N s/m
    dry       : N m or N
    stiffness : N m/rad or N/m, about the joint's zero
    rotor     : kg m² or kg, at the joint
    quadratic : N m s²/rad² or N s²/m², of |q̇| q̇
    cubic     : N m s³/rad³ or N s³/m³, of q̇³
    constant  : N m or N, that the motor gives beside what moves the joint
    """

    damping: float = 0.0
    dry: float = 0.0
    stiffness: float = 0.0
    rotor: float = 0.0
    quadratic: float = 0.0
    cubic: float = 0.0
    constant: float = 0.0

    @property
    def is_polynomial(self) -> bool:
        """Whether the damping is more than in proportion to the speed."""
        return self.quadratic != 0.0 or self.cubic != 0.0

    def torque(self, q: Array, dq: Array) -> Array:
        """(N,) torque of all but the rotor at positions and velocities (N,) of the joint."""
        over_speed = self.damping + self.quadratic * np.abs(dq) + self.cubic * dq**2
        return over_speed * dq + self.dry * np.sign(dq) + self.stiffness * q + self.constant


@dataclass(frozen=True)
class SharedMotor:
    """A motor that several joints turn.

    turns   : (n,) its velocity is turns · q̇; its torque acts on each joint by as much
    damping : N m s/rad or N s/m
    dry     : N m or N
    rotor   : kg m² or kg
    """

    name: str
    turns: tuple[float, ...]
    damping: float = 0.0
    dry: float = 0.0
    rotor: float = 0.0

    def torque(self, dq: Array, ddq: Array) -> Array:
        """(N, n) on the joints, of their velocities and accelerations (N, n)."""
        turns = np.array(self.turns)
        speed = dq @ turns
        moved = self.damping * speed + self.dry * np.sign(speed) + self.rotor * (ddq @ turns)
        return np.outer(moved, turns)


@dataclass(frozen=True)
class LinkFile:
    """A robot as it is written to a file; shared motors have a place in MJCF alone."""

    geometry: Geometry
    bodies: tuple[Body, ...]
    friction: tuple[JointFriction, ...]
    motors: tuple[SharedMotor, ...] = ()


def bodies_of(standard: Array) -> tuple[Body, ...]:
    """The links as bodies, of (11 n,) standard parameters."""
    return tuple(Body.of(link) for link in np.reshape(standard, (-1, PARAMETERS_PER_JOINT)))


def frame(geometry: Geometry, joint: int) -> tuple[Array, Array]:
    """Place (3,) m and rotation (3, 3) of a joint's frame in the one before, the joint at zero."""
    ca, sa = math.cos(geometry.alpha[joint]), math.sin(geometry.alpha[joint])
    ct, st = math.cos(geometry.theta[joint]), math.sin(geometry.theta[joint])
    rotation = np.array([[ct, -st, 0.0], [ca * st, ca * ct, -sa], [sa * st, sa * ct, ca]])
    along = geometry.r[joint]
    return np.array([geometry.d[joint], -sa * along, ca * along]), rotation


def urdf(robot: LinkFile, name: str) -> str:
    """A URDF. It has no place for gravity, for a rotor's inertia, or for an offset."""
    root = ElementTree.Element("robot", name=name)
    ElementTree.SubElement(root, "link", name="base")
    for joint, body in enumerate(robot.bodies):
        geometry, friction = robot.geometry, robot.friction[joint]
        kind = "prismatic" if geometry.prismatic[joint] else "continuous"
        before = "base" if joint == 0 else f"link{joint}"
        element = ElementTree.SubElement(root, "joint", name=geometry.names[joint], type=kind)
        place, rotation = frame(geometry, joint)
        ElementTree.SubElement(element, "parent", link=before)
        ElementTree.SubElement(element, "child", link=f"link{joint + 1}")
        ElementTree.SubElement(element, "origin", xyz=_text(place), rpy=_text(roll_pitch_yaw(rotation)))
        ElementTree.SubElement(element, "axis", xyz="0 0 1")
        ElementTree.SubElement(
            element, "dynamics", damping=_number(friction.damping), friction=_number(friction.dry)
        )
        if kind == "prismatic":
            ElementTree.SubElement(element, "limit", lower="-1e9", upper="1e9", effort="1e9", velocity="1e9")
        link = ElementTree.SubElement(root, "link", name=f"link{joint + 1}")
        inertial = ElementTree.SubElement(link, "inertial")
        ElementTree.SubElement(inertial, "origin", xyz=_text(body.centre), rpy="0 0 0")
        ElementTree.SubElement(inertial, "mass", value=_number(body.mass))
        ElementTree.SubElement(inertial, "inertia", _inertia_attributes(body))
    return _document(root)


def sdf(robot: LinkFile, name: str) -> str:
    """An SDF 1.7 world with the robot, for gravity is the world's. It has no place for a rotor's inertia or an offset."""
    root = ElementTree.Element("sdf", version="1.7")
    world = ElementTree.SubElement(root, "world", name="default")
    ElementTree.SubElement(world, "gravity").text = _text(robot.geometry.gravity)
    model = ElementTree.SubElement(world, "model", name=name)
    joints = sdf_joint_names(robot.geometry.names)
    fixing, *links = _beside(joints, ["to_the_world", "base", *(f"link{n + 1}" for n in range(len(joints)))])
    base = ElementTree.SubElement(model, "link", name=links[0])
    _sdf_inertial(base, Body(1.0, np.zeros(3), 0.01 * np.eye(3)))
    fixed = ElementTree.SubElement(model, "joint", name=fixing, type="fixed")
    ElementTree.SubElement(fixed, "parent").text = "world"
    ElementTree.SubElement(fixed, "child").text = links[0]
    for joint, body in enumerate(robot.bodies):
        geometry, friction = robot.geometry, robot.friction[joint]
        before, after = links[joint : joint + 2]
        place, rotation = frame(geometry, joint)
        link = ElementTree.SubElement(model, "link", name=after)
        pose = ElementTree.SubElement(link, "pose", relative_to=before)
        pose.text = f"{_text(place)} {_text(roll_pitch_yaw(rotation))}"
        _sdf_inertial(link, body)
        kind = "prismatic" if geometry.prismatic[joint] else "revolute"
        element = ElementTree.SubElement(model, "joint", name=joints[joint], type=kind)
        ElementTree.SubElement(element, "parent").text = before
        ElementTree.SubElement(element, "child").text = after
        axis = ElementTree.SubElement(element, "axis")
        ElementTree.SubElement(axis, "xyz").text = "0 0 1"
        limit = ElementTree.SubElement(axis, "limit")
        ElementTree.SubElement(limit, "lower").text = "-1e16"
        ElementTree.SubElement(limit, "upper").text = "1e16"
        dynamics = ElementTree.SubElement(axis, "dynamics")
        ElementTree.SubElement(dynamics, "damping").text = _number(friction.damping)
        ElementTree.SubElement(dynamics, "friction").text = _number(friction.dry)
        ElementTree.SubElement(dynamics, "spring_stiffness").text = _number(friction.stiffness)
        ElementTree.SubElement(dynamics, "spring_reference").text = "0"
    return _document(root)


def sdf_joint_names(names: Sequence[str]) -> tuple[str, ...]:
    """The joints' names as SDF allows them: not `world`, nor with `::`, with blanks at an end or with `__` at both."""
    written: list[str] = []
    for name in names:
        allowed = re.sub(":{2,}", ":", name).strip()
        if allowed in ("", "world") or (allowed.startswith("__") and allowed.endswith("__")):
            allowed += "_joint"
        written.append(name if name == allowed else _beside([*names, *written], [allowed])[0])
    return tuple(written)


def joints_renamed(names: Sequence[str]) -> list[str]:
    """Remarks on joints whose names SDF does not allow."""
    return [
        f"SDF allows no joint the name {name!r}: it is {allowed!r} there"
        for name, allowed in zip(names, sdf_joint_names(names), strict=True)
        if name != allowed
    ]


def _beside(taken: Sequence[str], names: Sequence[str]) -> list[str]:
    """Names that nothing else of a model has, whose links and joints must differ in SDF; those that are taken get a `_`."""
    free = []
    for name in names:
        while name in taken or name in free:
            name += "_"
        free.append(name)
    return free


def mjcf(robot: LinkFile, name: str) -> str:
    """An MJCF model. Its dry friction is a soft constraint: a joint that it holds at rest creeps.

    A constant torque is the bias of the joint's actuator, whose force is the control less that constant: the control is then
    the torque that the motor must give. A motor without one is the same with a bias of nought. A motor that several joints
    turn is a fixed tendon.
    """
    root = ElementTree.Element("mujoco", model=name)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false")
    ElementTree.SubElement(root, "option", gravity=_text(robot.geometry.gravity), integrator="implicitfast")
    parent = ElementTree.SubElement(root, "worldbody")
    actuators = ElementTree.Element("actuator")
    for joint, body in enumerate(robot.bodies):
        geometry, friction = robot.geometry, robot.friction[joint]
        place, rotation = frame(geometry, joint)
        parent = ElementTree.SubElement(
            parent, "body", name=f"link{joint + 1}", pos=_text(place), quat=_text(quaternion(rotation))
        )
        inertia = body.inertia
        ElementTree.SubElement(
            parent,
            "inertial",
            pos=_text(body.centre),
            mass=_number(body.mass),
            fullinertia=_text(inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]),
        )
        ElementTree.SubElement(
            parent,
            "joint",
            name=geometry.names[joint],
            type="slide" if geometry.prismatic[joint] else "hinge",
            axis="0 0 1",
            armature=_number(friction.rotor),
            damping=_polynomial(friction),
            frictionloss=_number(friction.dry),
            stiffness=_number(friction.stiffness),
        )
        actuator = {"name": geometry.names[joint], "joint": geometry.names[joint]}
        if friction.constant:
            bias = {"gainprm": "1", "biastype": "affine", "biasprm": _number(-friction.constant)}
            ElementTree.SubElement(actuators, "general", actuator | bias)
        else:
            ElementTree.SubElement(actuators, "motor", actuator)
    root.append(actuators)
    if robot.motors:
        _tendons(ElementTree.SubElement(root, "tendon"), robot)
    return _document(root)


def _tendons(parent: ElementTree.Element, robot: LinkFile) -> None:
    for motor in robot.motors:
        tendon = ElementTree.SubElement(
            parent,
            "fixed",
            name=motor.name,
            damping=_number(motor.damping),
            frictionloss=_number(motor.dry),
            armature=_number(motor.rotor),
        )
        for name, turns in zip(robot.geometry.names, motor.turns, strict=True):
            if turns:
                ElementTree.SubElement(tendon, "joint", joint=name, coef=_number(turns))


def _polynomial(friction: JointFriction) -> str:
    """Damping of MJCF: of q̇ alone, which all versions read, or of q̇, |q̇| q̇ and q̇³."""
    terms = (friction.damping, friction.quadratic, friction.cubic)
    return " ".join(_number(term) for term in (terms if friction.is_polynomial else terms[:1]))


WRITERS: dict[str, Callable[[LinkFile, str], str]] = {"urdf": urdf, "sdf": sdf, "xml": mjcf}
"""by the ending of the file"""


def _sdf_inertial(link: ElementTree.Element, body: Body) -> None:
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "pose").text = f"{_text(body.centre)} 0 0 0"
    ElementTree.SubElement(inertial, "mass").text = _number(body.mass)
    inertia = ElementTree.SubElement(inertial, "inertia")
    for name, value in _inertia_attributes(body).items():
        ElementTree.SubElement(inertia, name).text = value


def _inertia_attributes(body: Body) -> dict[str, str]:
    places = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    return {name: _number(body.inertia[place]) for name, place in places.items()}


def _number(value: float) -> str:
    return repr(float(value))


def _text(values: Sequence[float] | Array) -> str:
    return " ".join(_number(float(value)) for value in values)


def _document(root: ElementTree.Element) -> str:
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"
