"""A robot in MuJoCo's MJCF as a URDF's tree: bodies, joints, defaults and angles as its XML reference states them.

<https://mujoco.readthedocs.io/en/stable/XMLreference.html>: compiler (angle, eulerseq, autolimits, inertiafromgeom), default,
body, joint, inertial, geom, equality/joint.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from identify.dynamics.mjcf_shapes import LONG, SIZES, WATER, WITHOUT_MASS, Solid, body_of
from identify.dynamics.robot_tree import RobotTree, numbers, placed
from identify.dynamics.rotations import from_quaternion
from identify.recording.errors import InputError

Array = NDArray[np.float64]
BASE = "world"
NOT_EXPANDED = ("include", "attach", "replicate", "frame", "composite", "flexcomp")
KINDS = {"hinge": "revolute", "slide": "prismatic", "ball": "ball", "free": "free"}


def read_mjcf(path: Path, root: ElementTree.Element) -> RobotTree:
    """The world's bodies.

    Raises InputError with one line naming file and element.
    """
    passed_tag = next((element.tag for element in root.iter() if element.tag in NOT_EXPANDED), None)
    if passed_tag is not None:
        raise InputError(
            f"{path}: holds <{passed_tag}>; expand it first: let MuJoCo load the file and save it (mj_saveLastXML)"
        )
    return _World(path, root).tree()


class _World:
    def __init__(self, path: Path, root: ElementTree.Element) -> None:
        self.path = path
        self.root = root
        compiler: dict[str, str] = {}
        for element in root.findall("compiler"):
            compiler |= element.attrib
        self.degrees = compiler.get("angle", "degree") == "degree"
        self.sequence = compiler.get("eulerseq", "xyz")
        if len(self.sequence) != 3 or not set(self.sequence.lower()) <= set("xyz"):
            raise InputError(
                f'{path}: <compiler eulerseq="{self.sequence}">: must be three letters of x, y, z'
            )
        self.auto_limits = compiler.get("autolimits", "true") == "true"
        if compiler.get("coordinate", "local") != "local":
            raise InputError(
                f'{path}: coordinate="global" is no longer MJCF; let MuJoCo 2.3 save the file anew'
            )
        self.from_shapes = compiler.get("inertiafromgeom", "auto")
        groups = numbers(path, "compiler", "inertiagrouprange", compiler.get("inertiagrouprange", "0 5"), 2)
        self.groups = (int(groups[0]), int(groups[1]))
        if float(numbers(path, "compiler", "settotalmass", compiler.get("settotalmass", "-1"), 1)[0]) > 0:
            raise InputError(
                f"{path}: <compiler settotalmass> is not read; let MuJoCo load the file and save it (mj_saveLastXML)"
            )
        self.defaults: dict[str, dict[str, dict[str, str]]] = {}
        for element in root.findall("default"):
            self._read_defaults(element, {}, element.get("class", "main"))
        self.mimics = {
            each.get("joint1", ""): each.get("joint2", "")
            for each in root.findall("equality/joint")
            if each.get("joint2") and each.get("active", "true") == "true"
        }
        self.count = 0
        self.built = RobotTree(root.get("model", "robot"))

    def _read_defaults(
        self, element: ElementTree.Element, above: Mapping[str, dict[str, str]], name: str
    ) -> None:
        stated = {kind: element.find(kind) for kind in ("joint", "geom")}
        here = {
            kind: above.get(kind, {}) | ({} if each is None else each.attrib) for kind, each in stated.items()
        }
        self.defaults[name] = here
        for below in element.findall("default"):
            self._read_defaults(below, here, below.get("class", ""))

    def tree(self) -> RobotTree:
        world = self.root.find("worldbody")
        if world is None:
            raise InputError(f"{self.path}: has no <worldbody>")
        self.built.link(BASE)
        for body in world.findall("body"):
            self._body(body, BASE, np.eye(4), "main")
        return self.built

    def _body(self, body: ElementTree.Element, parent: str, shift: Array, above: str) -> None:
        """Add a body and those in it; shift (4, 4) is the parent body's frame in its link's."""
        self.count += 1
        name = body.get("name") or f"body{self.count}"
        cls = body.get("childclass", above)
        frame = shift @ self._placement(body, name)
        joints = [self._attributes(joint, cls, name) for joint in body.findall("joint")]
        if body.find("freejoint") is not None or any(each.get("type") == "free" for each in joints):
            self.built.remarks.append(f"body '{name}' is free: taken as fixed in its place")
            joints = []
        anchor = np.zeros(3)
        for number, joint in enumerate(joints):
            last = number == len(joints) - 1
            at = self._numbers(joint, "pos", "0 0 0", name, 3)
            placement = (
                frame @ placed(at - anchor, np.eye(3)) if number == 0 else placed(at - anchor, np.eye(3))
            )
            child = name if last else f"{name}.{number + 1}"
            if not last:
                self.built.link(child)
            self._joint(joint, name, parent, child, placement)
            parent, anchor = child, at
        if not joints:
            self.built.joint(f"{name} fixed", "fixed", parent, name, frame)
        body_frame = placed(-anchor, np.eye(3))
        self._link(body, name, body_frame, cls)
        for below in body.findall("body"):
            self._body(below, name, body_frame, cls)

    def _attributes(self, joint: ElementTree.Element, cls: str, body: str) -> dict[str, str]:
        wanted = joint.get("class", cls)
        if wanted not in self.defaults and wanted != "main":
            raise InputError(f"{self.path}: body '{body}': there is no default class '{wanted}'")
        return self.defaults.get(wanted, {}).get(joint.tag, {}) | joint.attrib

    def _joint(self, joint: Mapping[str, str], body: str, parent: str, child: str, placement: Array) -> None:
        name = joint.get("name") or f"{child} joint"
        kind = KINDS.get(joint.get("type", "hinge"), joint.get("type", ""))
        limits = None
        limited = joint.get("limited", "auto")
        if "range" in joint and (limited == "true" or (limited == "auto" and self.auto_limits)):
            low, high = self._numbers(joint, "range", "", name, 2)
            limits = self._angles(np.array([low, high])) if kind == "revolute" else np.array([low, high])
        if self._numbers(joint, "ref", "0", name, 1)[0]:
            raise InputError(
                f"{self.path}: joint '{name}': ref is not read; set it to 0 and turn the body instead"
            )
        axis = self._numbers(joint, "axis", "0 0 1", name, 3)
        self.built.joint(
            name,
            kind,
            parent,
            child,
            placement,
            axis=axis.tolist(),
            limits=None
            if limits is None or not limits[0] < limits[1]
            else (float(limits[0]), float(limits[1])),
            mimics=self.mimics.get(name),
        )

    def _link(self, body: ElementTree.Element, name: str, link_frame: Array, cls: str) -> None:
        inertial = body.find("inertial")
        if self.from_shapes == "true" or (inertial is None and self.from_shapes == "auto"):
            mass, centre, tensor = body_of(self._solids(body, name, cls))
            self.built.link(name, mass=mass, placement=link_frame @ placed(centre, np.eye(3)), tensor=tensor)
            return
        if inertial is None:
            self.built.link(name)
            return
        if "fullinertia" in inertial.attrib:
            xx, yy, zz, xy, xz, yz = self._numbers(inertial.attrib, "fullinertia", "", name, 6)
            tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        else:
            tensor = np.diag(self._numbers(inertial.attrib, "diaginertia", "0 0 0", name, 3))
        mass = float(self._numbers(inertial.attrib, "mass", "0", name, 1)[0])
        self.built.link(
            name, mass=mass, placement=link_frame @ self._placement(inertial, name), tensor=tensor
        )

    def _solids(self, body: ElementTree.Element, name: str, cls: str) -> list[Solid]:
        """The shapes that MuJoCo takes a body's mass from."""
        solids: list[Solid] = []
        for number, geom in enumerate(body.findall("geom"), start=1):
            attributes = self._attributes(geom, cls, name)
            owner = attributes.get("name") or f"{name}, geom {number}"
            kind = attributes.get("type", "sphere")
            group = int(self._numbers(attributes, "group", "0", owner, 1)[0])
            if kind in WITHOUT_MASS or not self.groups[0] <= group <= self.groups[1]:
                continue
            mass = (
                float(self._numbers(attributes, "mass", "0", owner, 1)[0]) if "mass" in attributes else None
            )
            density = float(self._numbers(attributes, "density", repr(WATER), owner, 1)[0])
            if mass == 0 or (mass is None and density == 0):
                continue
            if kind not in SIZES or attributes.get("shellinertia", "false") == "true":
                self.built.remarks.append(
                    f"'{owner}' is a {kind if kind not in SIZES else 'shell'}, whose inertia MuJoCo computes and we do not: taken"
                    " as no mass; let MuJoCo save the file with inertials (mj_saveLastXML)"
                )
                continue
            solids.append(self._solid(attributes, kind, owner, mass, density))
        return solids

    def _solid(
        self, attributes: Mapping[str, str], kind: str, owner: str, mass: float | None, density: float
    ) -> Solid:
        sizes = attributes.get("size", "").split()
        if "fromto" in attributes and kind in LONG:
            ends = self._numbers(attributes, "fromto", "", owner, 6)
            radius = numbers(self.path, owner, "size", " ".join(sizes[:1]), 1)
            way = ends[:3] - ends[3:]
            half = float(np.linalg.norm(self._with_length(way, "fromto", owner))) / 2
            thick = radius if SIZES[kind] == 2 else np.repeat(radius, 2)
            frame = self._placement_of(
                {"pos": _words((ends[:3] + ends[3:]) / 2), "zaxis": _words(way)}, owner
            )
            return Solid(kind, np.append(thick, half), frame, mass, density)
        size = numbers(self.path, owner, "size", " ".join(sizes[: SIZES[kind]]), SIZES[kind])
        return Solid(kind, size, self._placement_of(attributes, owner), mass, density)

    def _placement(self, element: ElementTree.Element, owner: str) -> Array:
        return self._placement_of(element.attrib, owner)

    def _placement_of(self, attributes: Mapping[str, str], owner: str) -> Array:
        """(4, 4) of pos and one of quat, axisangle, euler, xyaxes, zaxis."""
        position = self._numbers(attributes, "pos", "0 0 0", owner, 3)
        if "quat" in attributes:
            values = self._numbers(attributes, "quat", "", owner, 4)
            return placed(position, from_quaternion(self._with_length(values, "quat", owner)))
        if "axisangle" in attributes:
            values = self._numbers(attributes, "axisangle", "", owner, 4)
            axis = self._with_length(values[:3], "axisangle", owner)
            turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * self._angles(values[3:])[0])
            return placed(position, turn.as_matrix())
        if "euler" in attributes:
            values = self._angles(self._numbers(attributes, "euler", "", owner, 3))
            turn = Rotation.identity()
            for letter, angle in zip(self.sequence, values, strict=True):
                step = Rotation.from_euler(letter.lower(), angle)
                # small letters turn about the axes as moved so far, capitals about those that stand
                turn = turn * step if letter.islower() else step * turn
            return placed(position, turn.as_matrix())
        if "xyaxes" in attributes:
            values = self._numbers(attributes, "xyaxes", "", owner, 6)
            x = self._with_length(values[:3], "xyaxes", owner)
            x = x / np.linalg.norm(x)
            y = self._with_length(values[3:] - (values[3:] @ x) * x, "xyaxes", owner)
            y = y / np.linalg.norm(y)
            return placed(position, np.column_stack([x, y, np.cross(x, y)]))
        if "zaxis" in attributes:
            z = self._with_length(self._numbers(attributes, "zaxis", "", owner, 3), "zaxis", owner)
            z = z / np.linalg.norm(z)
            across = np.cross([0.0, 0.0, 1.0], z)
            sine, cosine = float(np.linalg.norm(across)), float(z[2])
            axis = across / sine if sine > 1e-12 else np.array([1.0, 0.0, 0.0])
            return placed(position, Rotation.from_rotvec(axis * np.arctan2(sine, cosine)).as_matrix())
        return placed(position, np.eye(3))

    def _angles(self, values: Array) -> Array:
        return np.deg2rad(values) if self.degrees else values

    def _with_length(self, values: Array, what: str, owner: str) -> Array:
        if np.linalg.norm(values) < 1e-12:
            raise InputError(f"{self.path}: '{owner}': {what} has no length")
        return values

    def _numbers(
        self, attributes: Mapping[str, str], key: str, default: str, owner: str, count: int
    ) -> Array:
        return numbers(self.path, owner, key, attributes.get(key, default), count)


def _words(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
