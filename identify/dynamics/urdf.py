"""A robot from a URDF: its joints' axes put into modified Denavit-Hartenberg frames; and back into a URDF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from identify.dynamics.geometry import NOMINAL_ANGLE_TOLERANCE, Geometry
from identify.dynamics.rotations import roll_pitch_yaw
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT
from identify.dynamics.urdf_chain import ChainJoint, carried_inertia, read_chain
from identify.recording.experiment_file import (
    Joint,
    JointLimits,
    LinkBody,
    PriorBodies,
    Robot,
    check_settings,
)
from identify.recording.plain_text import printable

Array = NDArray[np.float64]
EARTH = (0.0, 0.0, -9.81)
COINCIDENT = 1e-9
"""m; axes closer than this meet."""


@dataclass(frozen=True)
class UrdfRobot:
    """A robot read from a URDF, or from an SDF or MJCF that says the same.

    robot       : as it stands in an experiment; its joint positions are the URDF's
    standard    : (11 n,) standard parameters by the URDF's inertials, Ia zero
    first_frame : (4, 4) frame 0 in the URDF's base link; they differ where the first axis does not cross x
    last_frame  : (4, 4) frame of the URDF's last moving link in frame n; a payload is declared in frame n
    remarks     : what was decided while reading, in words
    """

    robot: Robot
    standard: Array
    first_frame: Array
    last_frame: Array
    remarks: tuple[str, ...] = ()

    def prior(self, source: str) -> PriorBodies | None:
        """The links' bodies as an experiment declares them; None where the file states no mass at all."""
        links = self.standard.reshape(-1, PARAMETERS_PER_JOINT)[:, :10]
        if not links.any():
            return None
        return PriorBodies(
            source=printable(source) or "file",
            links=tuple(_body(link) for link in links),
            remarks=tuple(map(printable, self.remarks)),
        )


def read_urdf(
    path: Path | str,
    *,
    tip: str | None = None,
    gravity: Sequence[float] = EARTH,
    drive_gains: Sequence[float] | None = None,
) -> UrdfRobot:
    """Read a serial robot from a URDF, SDF or MJCF: revolute, continuous and prismatic joints; fixed ones are merged.

    tip         : link at which the chain ends, needed where movable joints branch
    gravity     : (3,) m/s^2 in the URDF's base link
    drive_gains : (n,) joint torque per unit of command, 1 where left out (the command is then the joint
                  torque)
    Raises InputError with one line naming file and element.
    """
    chain, remarks = read_chain(Path(path), tip)
    frames, first = _link_frames(chain)
    origin_of_joint = _joint_frames(chain)
    joints, standard = [], np.zeros((len(chain), PARAMETERS_PER_JOINT))
    previous = first
    for k, (joint, frame) in enumerate(zip(chain, frames, strict=True)):
        alpha, d, theta, r = _denavit_hartenberg(previous, frame)
        joints.append(
            check_settings(
                Joint,
                {
                    "name": joint.name,
                    "type": "prismatic" if joint.type == "prismatic" else "revolute",
                    "alpha": alpha,
                    "d": d,
                    "theta": theta,
                    "r": r,
                    "drive_gain": 1.0 if drive_gains is None else float(drive_gains[k]),
                    "limits": _limits(joint),
                },
                {},
                f"{path}: joint '{printable(joint.name)[:80]}'",
            )
        )
        standard[k, :10] = carried_inertia(np.linalg.inv(frame) @ origin_of_joint[k], joint.inertia)
        previous = frame
    x, y, z = first[:3, :3].T @ np.asarray(gravity, dtype=float)
    return UrdfRobot(
        robot=check_settings(
            Robot, {"gravity": (float(x), float(y), float(z)), "joints": tuple(joints)}, {}, path
        ),
        standard=standard.ravel(),
        first_frame=first,
        last_frame=np.linalg.inv(frames[-1]) @ origin_of_joint[-1],
        remarks=remarks,
    )


def write_urdf(
    path: Path | str,
    robot: Robot,
    standard: ArrayLike,
    *,
    name: str = "robot",
    damping: Sequence[float] | None = None,
    friction: Sequence[float] | None = None,
) -> None:
    """Write a robot whose standard parameters are all known, one link per frame of the experiment.

    standard          : (11 n,) standard parameters; the rotors' Ia have no place in a URDF and are left out
    damping, friction : (n,) viscous (N m s/rad) and dry friction (N m) of the joints, where identified
    Raises ValueError for a link without positive mass: its centre of mass is then not defined, and a reader
    of the file could do nothing with it.
    """
    geometry = Geometry.from_robot(robot)
    links = np.asarray(standard, dtype=float).reshape(geometry.joint_count, PARAMETERS_PER_JOINT)[:, :10]
    for joint, link in zip(robot.joints, links, strict=True):
        if link[9] <= 0:
            raise ValueError(f"link of joint '{joint.name}': mass {link[9]:.6g} kg must be above zero")
    gravity = " ".join(f"{value:.9g}" for value in robot.gravity)
    text = ['<?xml version="1.0"?>', f"<!-- gravity in the base link: {gravity} m/s^2 -->"]
    text += [f"<robot name={quoteattr(name)}>", '  <link name="base"/>']
    parent = "base"
    for k, joint in enumerate(robot.joints):
        child = f"link{k + 1}"
        text += _link_text(child, links[k])
        text += _joint_text(
            joint,
            _frame_in_previous(geometry, k),
            (parent, child),
            {
                key: value[k]
                for key, value in (("damping", damping), ("friction", friction))
                if value is not None
            },
        )
        parent = child
    text.append("</robot>")
    Path(path).write_text("\n".join(text) + "\n", encoding="utf-8")


def _body(link: Array) -> LinkBody:
    """(10,) link parameters about the frame's origin as mass, centre and the inertia about the centre."""
    mass, moment = float(link[9]), link[6:9]
    x, y, z = moment / mass if mass else np.zeros(3)
    about_centre = link[:6] - mass * np.array(
        [y * y + z * z, -x * y, -x * z, x * x + z * z, -y * z, x * x + y * y]
    )
    xx, xy, xz, yy, yz, zz = about_centre.tolist()
    return LinkBody(mass=mass, com=(float(x), float(y), float(z)), inertia=(xx, xy, xz, yy, yz, zz))


def _link_text(name: str, link: Array) -> list[str]:
    body = _body(link)
    mass, (x, y, z), (xx, xy, xz, yy, yz, zz) = body.mass, body.com, body.inertia
    return [
        f'  <link name="{name}">',
        "    <inertial>",
        f'      <origin xyz="{_text(x, y, z)}" rpy="0 0 0"/>',
        f'      <mass value="{_text(mass)}"/>',
        f'      <inertia ixx="{_text(xx)}" ixy="{_text(xy)}" ixz="{_text(xz)}"'
        f' iyy="{_text(yy)}" iyz="{_text(yz)}" izz="{_text(zz)}"/>',
        "    </inertial>",
        "  </link>",
    ]


def _joint_text(joint: Joint, frame: Array, ends: tuple[str, str], losses: dict[str, float]) -> list[str]:
    limits = joint.limits or JointLimits()
    kind: str = joint.type
    if kind == "revolute" and limits.position is None:
        kind = "continuous"
    angles = roll_pitch_yaw(frame[:3, :3])
    text = [
        f'  <joint name={quoteattr(joint.name)} type="{kind}">',
        f'    <origin xyz="{_text(*frame[:3, 3])}" rpy="{_text(*angles)}"/>',
        f'    <parent link="{ends[0]}"/>',
        f'    <child link="{ends[1]}"/>',
        '    <axis xyz="0 0 1"/>',
    ]
    lower, upper = limits.position or (-1e9, 1e9)  # a prismatic joint must state limits
    if kind != "continuous":
        speed = limits.velocity or 1e9
        text.append(
            f'    <limit lower="{_text(lower)}" upper="{_text(upper)}" effort="1e9" velocity="{_text(speed)}"/>'
        )
    if losses:
        text.append(
            "    <dynamics " + " ".join(f'{key}="{_text(value)}"' for key, value in losses.items()) + "/>"
        )
    return [*text, "  </joint>"]


def _text(*values: float) -> str:
    return " ".join(repr(float(value)) for value in values)


def _frame_in_previous(geometry: Geometry, joint: int) -> Array:
    """(4, 4) frame of a joint at q = 0 in the one before."""
    frame = np.eye(4)
    alpha, r = geometry.alpha[joint], geometry.r[joint]
    frame[:3, :3] = Rotation.from_euler("XZ", [alpha, geometry.theta[joint]]).as_matrix()
    frame[:3, 3] = geometry.d[joint], -r * np.sin(alpha), r * np.cos(alpha)
    return frame


def _joint_frames(chain: list[ChainJoint]) -> list[Array]:
    """(4, 4) frames of the URDF's joints at q = 0 in the base link."""
    frames, place = [], np.eye(4)
    for joint in chain:
        place = place @ joint.placement
        frames.append(place)
    return frames


def _link_frames(chain: list[ChainJoint]) -> tuple[list[Array], Array]:
    """Frames 1 .. n and frame 0 at q = 0 in the base link: z along the axes, x along their common normals.

    The origin of the last frame and its x are the URDF's where its axis allows.
    """
    frames = []
    x, z, foot = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.zeros(3)
    origin_of_joint = _joint_frames(chain)
    for joint, place in zip(chain, origin_of_joint, strict=True):
        point, direction = place[:3, 3], place[:3, :3] @ joint.axis
        x, origin, foot_on_next, direction = _common_normal(foot, z, point, direction, x)
        frames.append(_frame(x, z, origin))
        z, foot = direction, foot_on_next
    last = origin_of_joint[-1]
    across = min((last[:3, 0], last[:3, 1]), key=lambda axis: abs(axis @ z))
    frames.append(_frame(across - (across @ z) * z, z, foot + ((last[:3, 3] - foot) @ z) * z))
    return frames[1:], frames[0]


def _common_normal(
    foot: Array, z: Array, point: Array, direction: Array, previous_x: Array
) -> tuple[Array, Array, Array, Array]:
    """Common normal of two axes: its direction, its foot on the first, its foot on the second, the second's
    z.

    Axes that meet are given the normal nearest the one before, coincident ones the same.
    """
    across = np.cross(z, direction)
    sine = float(np.linalg.norm(across))
    way = point - foot
    if sine < NOMINAL_ANGLE_TOLERANCE:
        direction = z if z @ direction > 0 else -z
        beside = way - (way @ z) * z
        distance = float(np.linalg.norm(beside))
        if distance < COINCIDENT:
            return previous_x, foot, foot, direction
        return beside / distance, foot, foot + beside, direction
    x = across / sine
    distance = float(way @ x)
    if distance < -COINCIDENT or (abs(distance) <= COINCIDENT and x @ previous_x < -COINCIDENT):
        x = -x
    origin = foot + (np.cross(way, direction) @ across / sine**2) * z
    foot_on_next = point + (np.cross(way, z) @ across / sine**2) * direction
    return x, origin, foot_on_next, direction


def _frame(x: Array, z: Array, origin: Array) -> Array:
    x = x / np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3, :4] = np.column_stack([x, np.cross(z, x), z, origin])
    return frame


def _denavit_hartenberg(previous: Array, frame: Array) -> tuple[float, float, float, float]:
    """alpha, d, theta, r of a frame in the one before; rounding below 1e-12 is removed."""
    relative = np.linalg.inv(previous) @ frame
    alpha = np.arctan2(-relative[1, 2], relative[2, 2])
    theta = np.arctan2(-relative[0, 1], relative[0, 0])
    r = relative[2, 3] * np.cos(alpha) - relative[1, 3] * np.sin(alpha)
    alpha, d, theta, r = (
        0.0 if abs(value) < 1e-12 else float(value) for value in (alpha, relative[0, 3], theta, r)
    )
    return alpha, d, theta, r


def _limits(joint: ChainJoint) -> JointLimits | None:
    if joint.position_limits is None and joint.speed_limit is None:
        return None
    return JointLimits(position=joint.position_limits, velocity=joint.speed_limit)
