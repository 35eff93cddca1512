"""Torques of a robot as its URDF, SDF or MJCF describes it: by Pinocchio or MuJoCo where they are installed, else by the
reader of robots that `coulomb import` has.

Friction is that of the format's own rule at speed: damping, dry friction by the sign of the velocity, a spring about zero. Of an
MJCF the torque is the control of the joint's actuator, so that a constant force beside it counts.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.geometry import Geometry
from identify.dynamics.inverse_dynamics import InverseDynamics
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT
from identify.dynamics.urdf import read_urdf
from identify.export.link_files import JointFriction, SharedMotor
from identify.recording import InputError

Array = NDArray[np.float64]
ArmTorque = Callable[[Array, Array, Array], Array]
"""torque (N, n) of the file's robot at q, dq, ddq (N, n)"""

PROGRAMS = {".urdf": "pinocchio", ".xml": "mujoco"}
"""module of the program that a format is for and that is asked where it is installed"""
NAMES = {"pinocchio": "Pinocchio", "mujoco": "MuJoCo"}


class ProgramRefuses(Exception):
    """What a program says of a file that it does not take."""


def program_here(ending: str) -> str | None:
    """The module of the program for a format, where it is installed."""
    name = PROGRAMS.get(ending)
    return name if name is not None and importlib.util.find_spec(name) is not None else None


def arm_torque_by_program(program: str, path: Path, gravity: Array) -> tuple[ArmTorque, str]:
    """What a program computes of a file, and its name and version.

    gravity : (3,) m/s², which a URDF does not state; an MJCF does
    Raises ProgramRefuses: the program does not take the file.
    """
    module = importlib.import_module(program)
    try:
        torque = _by_pinocchio(module, path, gravity) if program == "pinocchio" else _by_mujoco(module, path)
    except (ValueError, RuntimeError) as refusal:
        said = " ".join(str(refusal).split())
        raise ProgramRefuses(
            f"{NAMES[program]} {module.__version__} does not take the file: {said}"
        ) from None
    return torque, f"{NAMES[program]} {module.__version__}"


def _by_pinocchio(pinocchio: ModuleType, path: Path, gravity: Array) -> ArmTorque:
    model: Any = pinocchio.buildModelFromXML(path.read_text(encoding="utf-8"))
    model.gravity.linear = np.asarray(gravity, float)
    data = model.createData()
    # a continuous joint is a cosine and a sine there
    round_about = [joint.nq == 2 for joint in list(model.joints)[1:]]

    def torque(q: Array, dq: Array, ddq: Array) -> Array:
        columns = [
            np.stack([np.cos(position), np.sin(position)], axis=1) if turns else position[:, None]
            for position, turns in zip(q.T, round_about, strict=True)
        ]
        rows = zip(np.hstack(columns), dq, ddq, strict=True)
        rigid = np.array([pinocchio.rnea(model, data, *row).copy() for row in rows])
        return rigid + model.damping * dq + model.friction * np.sign(dq)

    return torque


def _by_mujoco(mujoco: ModuleType, path: Path) -> ArmTorque:
    model: Any = mujoco.MjModel.from_xml_string(path.read_text(encoding="utf-8"))
    dry = model.dof_frictionloss.copy()
    model.dof_frictionloss[:] = 0.0  # a soft constraint there: at speed it is the sign of the velocity
    turns = _tendon_turns(model)
    tendon_dry = turns * model.tendon_frictionloss[:, None]
    model.tendon_frictionloss[:] = 0.0
    bias = np.zeros(model.nv)  # of actuators, whose control is what a motor must give
    driven = model.jnt_dofadr[model.actuator_trnid[:, 0]]
    bias[driven] = model.actuator_biasprm[:, 0]
    data = mujoco.MjData(model)

    def torque(q: Array, dq: Array, ddq: Array) -> Array:
        inverse = np.empty(q.shape)
        for row, (position, velocity, acceleration) in enumerate(zip(q, dq, ddq, strict=True)):
            data.qpos[:], data.qvel[:], data.qacc[:] = position, velocity, acceleration
            mujoco.mj_inverse(model, data)
            inverse[row] = data.qfrc_inverse
        return inverse + dry * np.sign(dq) + np.sign(dq @ turns.T) @ tendon_dry - bias

    return torque


def _tendon_turns(model: Any) -> Array:
    """(tendons, n) how each fixed tendon of a MuJoCo model moves with the joints."""
    turns = np.zeros((model.ntendon, model.nv))
    for tendon, (first, count) in enumerate(zip(model.tendon_adr, model.tendon_num, strict=True)):
        joints = model.wrap_objid[first : first + count]
        turns[tendon, model.jnt_dofadr[joints]] = model.wrap_prm[first : first + count]
    return turns


def arm_torque_by_own_reader(path: Path, gravity: Array) -> ArmTorque:
    """What the file's text says, read by `identify.dynamics.urdf` and computed by recursive Newton-Euler.

    gravity : (3,) m/s², which a URDF does not state; the others do
    Raises InputError: the file is no robot.
    """
    root = ElementTree.fromstring(path.read_text(encoding="utf-8"))
    stated = _gravity(root)
    robot = read_urdf(path, gravity=(gravity if stated is None else stated).tolist())
    friction = _friction(root)
    joints = [friction[joint.name] for joint in robot.robot.joints]
    motors = _shared_motors(root, [joint.name for joint in robot.robot.joints])
    standard = robot.standard.copy()
    standard[PARAMETERS_PER_JOINT - 1 :: PARAMETERS_PER_JOINT] = [joint.rotor for joint in joints]
    arm = InverseDynamics(Geometry.from_robot(robot.robot), [standard])

    def torque(q: Array, dq: Array, ddq: Array) -> Array:
        (rigid,) = arm.torques(q, dq, ddq)
        shared = sum((motor.torque(dq, ddq) for motor in motors), np.zeros(q.shape))
        return rigid + _of_joints(joints, q, dq) + shared

    return torque


def _of_joints(joints: Sequence[JointFriction], q: Array, dq: Array) -> Array:
    listed = zip(joints, q.T, dq.T, strict=True)
    return np.array([joint.torque(position, velocity) for joint, position, velocity in listed]).T


def _gravity(root: ElementTree.Element) -> Array | None:
    world, option = root.find("world/gravity"), root.find("option")
    text = world.text if world is not None else option.get("gravity") if option is not None else None
    return None if text is None else np.array([float(part) for part in text.split()])


def _friction(root: ElementTree.Element) -> dict[str, JointFriction]:
    """By the name of the joint."""
    by_name = {}
    for joint in root.iter("joint"):
        if root.tag == "mujoco":
            damping = [float(value) for value in joint.get("damping", "0").split()]
            dry, stiffness, rotor = (
                float(joint.get(name, 0)) for name in ("frictionloss", "stiffness", "armature")
            )
            quadratic, cubic = (*damping[1:], 0.0, 0.0)[:2]
            constant = -_bias(root, joint.get("name", ""))
            friction = JointFriction(damping[0], dry, stiffness, rotor, quadratic, cubic, constant)
        elif root.tag == "sdf":
            names = ("damping", "friction", "spring_stiffness")
            friction = JointFriction(*(float(joint.findtext(f"axis/dynamics/{name}") or 0) for name in names))
        else:
            dynamics = joint.find("dynamics")
            stated = {} if dynamics is None else dynamics.attrib
            friction = JointFriction(float(stated.get("damping", 0)), float(stated.get("friction", 0)))
        by_name[joint.get("name", "")] = friction
    return by_name


def _shared_motors(root: ElementTree.Element, names: Sequence[str]) -> list[SharedMotor]:
    """Motors that several joints turn: the fixed tendons of an MJCF."""
    motors = []
    for tendon in root.iterfind("tendon/fixed"):
        by_joint = {joint.get("joint"): float(joint.get("coef", 0)) for joint in tendon.iterfind("joint")}
        values = [float(tendon.get(name, 0)) for name in ("damping", "frictionloss", "armature")]
        turns = tuple(by_joint.get(name, 0.0) for name in names)
        motors.append(SharedMotor(tendon.get("name", ""), turns, *values))
    return motors


def _bias(root: ElementTree.Element, joint: str) -> float:
    """Constant force of a joint's actuator beside its control, N m or N."""
    listed = [each for each in root.iterfind("actuator/general") if each.get("joint") == joint]
    return sum(float(each.get("biasprm", "0").split()[0]) for each in listed)


def arm_torque(path: Path, gravity: Array) -> tuple[ArmTorque, str]:
    """What the file says, and who read it.

    gravity : (3,) m/s², which a URDF does not state
    Raises ProgramRefuses: the program that the format is for is installed, and does not take the file. InputError: the file is
        no robot.
    """
    program = program_here(path.suffix)
    if program is not None:
        torque, name = arm_torque_by_program(program, path, gravity)
        return torque, f"the file opened by {name}, friction by the format's own rule at speed"
    try:
        torque = arm_torque_by_own_reader(path, gravity)
    except ElementTree.ParseError as problem:
        raise InputError(f"{path.name}: is not XML: {problem}") from None
    other = NAMES.get(PROGRAMS.get(path.suffix, ""))
    missing = f"; {other} was not installed to open it" if other else ""
    return torque, (
        f"the file read back by coulomb's own reader of robots, friction by the format's own rule at speed{missing}"
    )
