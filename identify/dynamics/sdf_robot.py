"""A robot in SDFormat as a URDF's tree: poses in the frames that SDFormat 1.5 to 1.11 states them in.

A joint's frame is its `<pose>` in that of its child link unless `relative_to` names another, a link's pose is in the model's;
<http://sdformat.org/spec>, and "Pose Frame Semantics" there.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.robot_tree import RobotTree, numbers, placed
from identify.dynamics.rotations import from_quaternion, from_roll_pitch_yaw
from identify.recording.errors import InputError

Array = NDArray[np.float64]
WORLD = "world"
MODEL = "__model__"
UNLIMITED = 1e15
"""What a limit must stay below to be one: SDFormat writes 1e16 for none."""


def read_sdf(path: Path, root: ElementTree.Element) -> RobotTree:
    """The one model of a file.

    Raises InputError with one line naming file and element.
    """
    models = [model for model in root.iter("model") if model.find("link") is not None]
    if len(models) != 1:
        named = ", ".join(f"'{model.get('name', '?')}'" for model in models) or "none"
        remedy = (
            "expand its <include> first: gz sdf -p FILE"
            if not models and root.find(".//include") is not None
            else "keep the robot's alone in the file"
        )
        raise InputError(f"{path}: exactly one <model> with links is a robot, found {named}; {remedy}")
    model = models[0]
    if model.find("include") is not None or model.find("model") is not None:
        raise InputError(
            f"{path}: the model holds others by <include> or <model>; put their links into one file"
        )
    return _Model(path, model).tree()


class _Model:
    def __init__(self, path: Path, model: ElementTree.Element) -> None:
        self.path = path
        self.name = model.get("name", "robot")
        self.links = {link.get("name", ""): link for link in model.findall("link")}
        self.joints = {joint.get("name", ""): joint for joint in model.findall("joint")}
        self.frames = {frame.get("name", ""): frame for frame in model.findall("frame")}
        self._known: dict[str, Array] = {MODEL: np.eye(4), WORLD: np.eye(4), "": np.eye(4)}
        self._sought: list[str] = []

    def tree(self) -> RobotTree:
        tree = RobotTree(self.name)
        moved_by = {_text(joint, "child"): name for name, joint in self.joints.items()}
        link_frames: dict[
            str, Array
        ] = {}  # the frame of each link in the URDF: that of the joint that moves it
        for name in self.links:
            link_frames[name] = self._frame(moved_by.get(name, name), name)
        if any(_text(joint, "parent") == WORLD for joint in self.joints.values()):
            tree.link(WORLD)
            link_frames[WORLD] = np.eye(4)
        for name, link in self.links.items():
            mass, centre, tensor = self._inertial(name, link)
            beside = np.linalg.inv(link_frames[name]) @ self._frame(name, name)
            tree.link(name, mass=mass, placement=beside @ centre, tensor=tensor)
        for name, joint in self.joints.items():
            self._add_joint(tree, name, joint, link_frames)
        return tree

    def _add_joint(
        self, tree: RobotTree, name: str, joint: ElementTree.Element, link_frames: dict[str, Array]
    ) -> None:
        parent, child = _text(joint, "parent"), _text(joint, "child")
        for end, link in (("parent", parent), ("child", child)):
            if link not in link_frames:
                raise InputError(f"{self.path}: joint '{name}': its {end} link '{link}' does not exist")
        frame = self._frame(name, name)
        axis = joint.find("axis")
        direction = np.array([1.0, 0.0, 0.0])
        limits = speed = mimics = None
        if axis is not None:
            direction = self._axis(name, axis, frame)
            stated = [self._limit(name, axis, key) for key in ("lower", "upper")]
            if stated[0] is not None and stated[1] is not None and stated[0] < stated[1]:
                limits = (stated[0], stated[1])
            speed = self._limit(name, axis, "velocity")
            mimic = axis.find("mimic")
            mimics = None if mimic is None else mimic.get("joint", "")
        placement = np.linalg.inv(link_frames[parent]) @ frame
        kind = joint.get("type", "none")
        tree.joint(
            name,
            kind,
            parent,
            child,
            placement,
            axis=direction.tolist(),
            limits=limits,
            speed=speed,
            mimics=mimics,
        )

    def _axis(self, name: str, axis: ElementTree.Element, frame: Array) -> Array:
        element = axis.find("xyz")
        text = "0 0 1" if element is None else element.text or ""
        direction = numbers(self.path, name, "axis", text, 3)
        within = "" if element is None else element.get("expressed_in", "")
        older = (axis.findtext("use_parent_model_frame") or "").strip().lower() in ("1", "true")
        if within or older:
            stated = self._frame(within or MODEL, name)
            direction = frame[:3, :3].T @ stated[:3, :3] @ direction
        return direction

    def _limit(self, name: str, axis: ElementTree.Element, key: str) -> float | None:
        text = (axis.findtext(f"limit/{key}") or "").strip()
        if not text or text.lower().lstrip("+-") in ("inf", "infinity", "nan"):
            return None
        value = float(numbers(self.path, name, key, text, 1)[0])
        if abs(value) >= UNLIMITED or (key == "velocity" and value < 0):
            return None
        return value

    def _frame(self, name: str, asked_by: str) -> Array:
        """(4, 4) of a link, joint or frame in the model."""
        if name in self._known:
            return self._known[name]
        if name in self._sought:
            raise InputError(f"{self.path}: '{name}': its pose is stated relative to itself")
        self._sought.append(name)
        if name in self.links:
            element, usual = self.links[name], MODEL
        elif name in self.joints:
            element, usual = self.joints[name], _text(self.joints[name], "child")
        elif name in self.frames:
            element, usual = self.frames[name], self.frames[name].get("attached_to", MODEL)
        else:
            raise InputError(f"{self.path}: '{asked_by}': there is no link, joint or frame '{name}'")
        pose = element.find("pose")
        within = usual if pose is None else pose.get("relative_to") or pose.get("frame") or usual
        placed = self._frame(within, name) @ self._pose(pose, name)
        self._sought.pop()
        self._known[name] = placed
        return placed

    def _pose(self, pose: ElementTree.Element | None, owner: str) -> Array:
        if pose is None or not (pose.text or "").strip():
            return np.eye(4)
        if pose.get("rotation_format") == "quat_xyzw":
            values = numbers(self.path, owner, "pose", pose.text or "", 7)
            if not values[3:].any():
                raise InputError(
                    f"{self.path}: '{owner}': pose '{(pose.text or '').strip()}': its quaternion is zero"
                )
            return placed(values[:3], from_quaternion(values[[6, 3, 4, 5]]))
        values = numbers(self.path, owner, "pose", pose.text or "", 6)
        degrees = pose.get("degrees", "false").lower() in ("1", "true")
        return placed(values[:3], from_roll_pitch_yaw(np.deg2rad(values[3:]) if degrees else values[3:]))

    def _inertial(self, name: str, link: ElementTree.Element) -> tuple[float, Array, Array | None]:
        """Mass, (4, 4) of the axes of inertia in the link, (3, 3) inertia; without one SDFormat assumes 1 kg, we none."""
        inertial = link.find("inertial")
        if inertial is None:
            return 0.0, np.eye(4), None
        mass = float(numbers(self.path, name, "mass", inertial.findtext("mass") or "0", 1)[0])
        tensor = np.zeros((3, 3))
        for row, column in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
            key = f"i{'xyz'[row]}{'xyz'[column]}"
            text = inertial.findtext(f"inertia/{key}") or "0"
            tensor[row, column] = tensor[column, row] = numbers(self.path, name, key, text, 1)[0]
        return mass, self._pose(inertial.find("pose"), name), tensor


def _text(element: ElementTree.Element, tag: str) -> str:
    return (element.findtext(tag) or "").strip()
