"""The serial chain of movable joints in a URDF (or SDF, MJCF) file, everything fixed merged into the link that carries
it."""

from __future__ import annotations

import math
import sys
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers.expat import ExpatError, ParserCreate

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from identify.dynamics.geometry import nominal_angles
from identify.dynamics.mjcf_robot import read_mjcf
from identify.dynamics.sdf_robot import read_sdf
from identify.recording.errors import InputError

Array = NDArray[np.float64]
_OTHERS = {"sdf": read_sdf, "mujoco": read_mjcf}
"""By outermost element: files that are no URDF."""
_MIMICS = "it mimics another joint; a chain of independent joints is needed: name a link before it as the tip"
LARGEST = 1e12
"""Lengths, masses and inertias, in SI units; the squares of larger ones would soon be no numbers any more."""
MOVABLE = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}


@dataclass
class ChainJoint:
    """A movable joint and the rigid body beyond it, up to the next one.

    placement : (4, 4) its frame at q = 0 in the frame of the joint before it (of the base link for the first)
    axis      : (3,) unit vector in its own frame
    position_limits, speed_limit : as the file states, None where it does not
    inertia   : (10,) XX .. ZZ about the frame's origin, MX MY MZ, M, in the joint's frame
    """

    name: str
    type: str
    placement: Array
    axis: Array
    position_limits: tuple[float, float] | None
    speed_limit: float | None
    inertia: Array = field(default_factory=lambda: np.zeros(10))


def read_chain(path: Path, tip: str | None = None) -> tuple[list[ChainJoint], tuple[str, ...]]:
    """Movable joints from base to tip, and what was decided while reading, in words.

    tip : the link at which the chain ends; needed only where movable joints branch (a gripper with fingers).
          What hangs on by joints outside the chain is taken as fixed in its zero position.
    Raises InputError with one line naming file and element.
    """
    tree = _Tree(path)
    chain_links = tree.without_gripper(tree.only_tip()) if tip is None else tree.way_to(tip)
    moving = [joint for joint in chain_links if joint.get("type") in MOVABLE]
    if not moving:
        raise InputError(f"{path}: no revolute, continuous or prismatic joint between base and tip")
    chain: list[ChainJoint] = []
    since_last = np.eye(4)
    for joint in chain_links:
        since_last = since_last @ tree.placement(joint)
        if joint.get("type") in MOVABLE:
            chain.append(tree.chain_joint(joint, since_last))
            since_last = np.eye(4)
    names = {joint.get("name") for joint in moving}
    for current, joint in zip(chain, moving, strict=True):
        for link, frame in tree.rigid_body(tree.child(joint), names):
            current.inertia += carried_inertia(frame, tree.inertial(link))
    return chain, tuple(dict.fromkeys(tree.remarks))


def _independent(joint: ElementTree.Element) -> bool:
    """Whether a joint moves by a coordinate of its own."""
    return joint.get("type") != "fixed" and joint.find("mimic") is None


def read_xml(content: bytes) -> ElementTree.Element:
    """A document as a tree, prefixes of names left as they stand: ROS's tools take unbound ones, and so do its files.

    Raises ExpatError when it is not XML.
    """
    builder = ElementTree.TreeBuilder()
    parser = ParserCreate()
    parser.StartElementHandler = lambda tag, attributes: builder.start(tag, attributes)
    parser.EndElementHandler = lambda tag: builder.end(tag)
    parser.CharacterDataHandler = builder.data
    parser.Parse(content.lstrip(), True)
    return builder.close()


class _Tree:
    """Links and joints of one file, by name."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.remarks: list[str] = []
        try:
            root = read_xml(path.read_bytes())
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror}") from None
        except ExpatError as error:
            raise InputError(f"{path}: is not XML: {error}") from None
        outermost = root.tag.rpartition(":")[2]
        if outermost in _OTHERS:
            translated = _OTHERS[outermost](path, root)
            root = translated.root
            self.remarks += translated.remarks
        elif outermost != "robot":
            raise InputError(
                f"{path}: the outermost element must be <robot> (URDF), <sdf> or <mujoco>, not <{root.tag}>"
            )
        macro = next((element for element in root.iter() if element.tag.startswith("xacro:")), None)
        if macro is not None:
            raise InputError(f"{path}: holds <{macro.tag}>; expand it first: xacro FILE > robot.urdf")
        self.links = {link.get("name", ""): link for link in root.findall("link")}
        self.joints = root.findall("joint")
        self._refuse_same_names(root)
        self.to_link: dict[str, ElementTree.Element] = {}
        self.from_link: dict[str, list[ElementTree.Element]] = {}
        for joint in self.joints:
            for end in ("parent", "child"):
                name = self._end(joint, end)
                if name not in self.links:
                    raise self.wrong(joint, f"its {end} link '{name}' does not exist")
            if self.child(joint) in self.to_link:
                raise self.wrong(joint, f"link '{self.child(joint)}' hangs on two joints; a URDF is a tree")
            self.to_link[self.child(joint)] = joint
            self.from_link.setdefault(self._end(joint, "parent"), []).append(joint)
        bases = [name for name in self.links if name not in self.to_link]
        if len(bases) != 1:
            named = ", ".join(f"'{name}'" for name in bases) or "none"
            raise InputError(f"{path}: exactly one link must have no joint before it, found {named}")
        self.base = bases[0]
        self._refuse_loops()

    def _refuse_same_names(self, root: ElementTree.Element) -> None:
        for tag in ("link", "joint"):
            names = Counter(element.get("name", "") for element in root.findall(tag))
            doubled = next((name for name, count in names.items() if count > 1), None)
            if doubled is not None:
                raise InputError(
                    f"{self.path}: {names[doubled]} {tag}s are called '{doubled}'; names must differ"
                )
            if "" in names:
                raise InputError(f"{self.path}: a <{tag}> has no name")

    def _refuse_loops(self) -> None:
        """Every link must hang on the base; those that do not hang on one another in a circle."""
        waiting, reached = [self.base], {self.base}
        while waiting:
            for joint in self.from_link.get(waiting.pop(), []):
                reached.add(self.child(joint))
                waiting.append(self.child(joint))
        astray = next((name for name in self.links if name not in reached), None)
        if astray is not None:
            raise self.wrong(self.to_link[astray], "the links form a loop")

    def wrong(self, joint: ElementTree.Element, fault: str) -> InputError:
        return InputError(f"{self.path}: joint '{joint.get('name', '?')}': {fault}")

    def _end(self, joint: ElementTree.Element, end: str) -> str:
        element = joint.find(end)
        return "" if element is None else element.get("link", "")

    def child(self, joint: ElementTree.Element) -> str:
        return self._end(joint, "child")

    def only_tip(self) -> str:
        """The link behind the last movable joint, if no two movable joints branch."""
        above: set[str] = set()  # links with a joint beyond them that moves by itself
        for joint in filter(_independent, self.joints):
            link: str | None = self._end(joint, "parent")
            while link is not None and link not in above:
                above.add(link)
                link = self._end(self.to_link[link], "parent") if link in self.to_link else None
        tips = [
            self.child(joint)
            for joint in self.joints
            if _independent(joint) and self.child(joint) not in above
        ]
        if len(tips) > 1:
            return self._trunk(tips)
        if not tips:
            raise InputError(f"{self.path}: no revolute, continuous or prismatic joint")
        return tips[0]

    def _trunk(self, tips: list[str]) -> str:
        """The link behind the last joint that all tips hang on: the arm without its gripper.

        Only where that arm has more than twice as many movable joints as each branch beyond it; otherwise (two arms on a
        waist, a hand) no branch is the robot more than another.
        """
        ways = [[joint for joint in self.way_to(tip) if _independent(joint)] for tip in tips]
        common = 0
        while all(common < len(way) and way[common] is ways[0][common] for way in ways):
            common += 1
        longest = max(len(way) for way in ways) - common
        if common <= 2 * longest:
            choice = ", ".join(f"'{name}'" for name in tips)
            raise InputError(f"{self.path}: the joints branch; name the tip link, one of {choice}")
        tip = self.child(ways[0][common - 1])
        self.remarks.append(
            f"the joints branch beyond link '{tip}': the chain ends there, what hangs on is taken as fixed; --tip names another"
        )
        return tip

    def way_to(self, tip: str) -> list[ElementTree.Element]:
        """Joints from the base to a link; each is fixed or movable by one coordinate of its own."""
        if tip not in self.links:
            raise InputError(f"{self.path}: there is no link '{tip}' to be the tip")
        way: list[ElementTree.Element] = []
        while tip in self.to_link:
            if self.to_link[tip] in way:
                raise self.wrong(self.to_link[tip], "the links form a loop")
            way.insert(0, self.to_link[tip])
            tip = self._end(way[0], "parent")
        for joint in way:
            kind = joint.get("type", "none")
            if kind != "fixed" and kind not in MOVABLE:
                raise self.wrong(
                    joint,
                    f"type '{kind}': only revolute, continuous, prismatic, fixed are known; make it fixed if it does not"
                    " move while the robot is measured",
                )
            if joint.find("mimic") is not None:
                raise self.wrong(joint, _MIMICS)
        return way

    def without_gripper(self, tip: str) -> list[ElementTree.Element]:
        """Joints from the base to a link, without those at the end that others mimic: a gripper's."""
        way = self.way_to(tip)
        for follower in self.joints:
            mimicked = follower.find("mimic")
            name = "" if mimicked is None else mimicked.get("joint", "")
            places = [place for place, joint in enumerate(way) if joint.get("name") == name]
            if not places:
                continue
            kept = way[: places[0]]
            if sum(map(_independent, kept)) <= 2 * sum(map(_independent, way[places[0] :])):
                raise self.wrong(follower, _MIMICS)
            self.remarks.append(
                f"joint '{name}' is mimicked by others: taken as a gripper's and fixed, the chain ends before it"
            )
            way = kept
        return way

    def rigid_body(self, link: str, moving: set[str | None]) -> Iterator[tuple[str, Array]]:
        """Links that move as one with `link`, each with its frame in that of `link`."""
        waiting = [(link, np.eye(4))]
        while waiting:
            name, frame = waiting.pop()
            yield name, frame
            for joint in self.from_link.get(name, []):
                if joint.get("name") not in moving:
                    waiting.append((self.child(joint), frame @ self.placement(joint)))

    def chain_joint(self, joint: ElementTree.Element, placement: Array) -> ChainJoint:
        axis = np.array(self._numbers(joint.find("axis"), "xyz", "1 0 0", joint.get("name")))
        length = np.linalg.norm(axis)
        if length < 1e-9:
            raise self.wrong(joint, "its axis has no length")
        axis = axis / length
        nearly = np.round(axis)
        if np.linalg.norm(axis - nearly) < 1e-5:
            axis = nearly  # as typed in print, 0.99999999 -2e-9 0: a frame's axis
        limit = joint.find("limit")
        limits = speed = None
        if limit is not None:
            if joint.get("type") != "continuous" and {"lower", "upper"} <= set(limit.keys()):
                lower, upper = self._limit(joint, limit, "lower"), self._limit(joint, limit, "upper")
                limits = (lower, upper) if lower is not None and upper is not None and lower < upper else None
            speed = self._limit(joint, limit, "velocity")
            if speed is not None and speed < 0:
                self.remarks.append(
                    f"joint '{joint.get('name', '?')}': velocity=\"{speed:g}\" is taken as no limit"
                )
                speed = None
        kind = MOVABLE[joint.get("type", "")]
        return ChainJoint(joint.get("name", "?"), kind, placement, axis, limits, speed or None)

    def _limit(self, joint: ElementTree.Element, limit: ElementTree.Element, key: str) -> float | None:
        """A limit as stated; None where it is infinite or not there."""
        if limit.get(key, "").strip().lower().lstrip("+-") in ("inf", "infinity", ".inf", "nan", ""):
            return None
        # Gazebo writes 1e16 for no limit, others the largest number that there is.
        return self._numbers(limit, key, "0", joint.get("name"), 1, sys.float_info.max)[0]

    def placement(self, element: ElementTree.Element, owner: str | None = None) -> Array:
        """(4, 4) of an element's <origin>."""
        origin = element.find("origin")
        name = owner or element.get("name")
        frame = np.eye(4)
        frame[:3, 3] = self._numbers(origin, "xyz", "0 0 0", name)
        angles = nominal_angles(self._numbers(origin, "rpy", "0 0 0", name))
        frame[:3, :3] = Rotation.from_euler("xyz", angles).as_matrix()
        frame[:3, :3][np.abs(frame[:3, :3]) < 1e-15] = 0.0
        return frame

    def inertial(self, link: str) -> Array:
        """(10,) inertia of a link about its own frame's origin."""
        element = self.links[link].find("inertial")
        if element is None:
            return np.zeros(10)
        (mass,) = self._numbers(element.find("mass"), "value", "0", link, 1)
        if mass < 0:
            raise InputError(f"{self.path}: link '{link}': mass {mass:g} kg must not be negative")
        tensor = np.zeros((3, 3))
        stated = element.find("inertia")
        for row, column in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
            key = "i" + "xyz"[row] + "xyz"[column]
            tensor[row, column] = tensor[column, row] = self._numbers(stated, key, "0", link, 1)[0]
        about_centre = np.zeros(10)
        about_centre[:6] = tensor[np.triu_indices(3)]
        about_centre[9] = mass
        return carried_inertia(self.placement(element, link), about_centre)

    def _numbers(
        self,
        element: ElementTree.Element | None,
        key: str,
        default: str,
        owner: str | None,
        count: int = 3,
        largest: float = LARGEST,
    ) -> list[float]:
        text = default if element is None else element.get(key, default)
        try:
            values = [float(word) for word in text.split()]
        except ValueError:
            values = []
        if len(values) != count or not all(map(math.isfinite, values)):
            wanted = "a number" if count == 1 else f"{count} numbers"
            raise InputError(f"{self.path}: '{owner}': {key}=\"{text[:80]}\" must be {wanted}")
        if max(map(abs, values)) > largest:
            raise InputError(
                f"{self.path}: '{owner}': {key}=\"{text[:80]}\" is beyond {largest:g}, which no robot has"
            )
        return values


def carried_inertia(frame: Array, inertia: Array) -> Array:
    """(10,) inertia of a body in an outer frame, given in an inner one whose place in the outer is
    `frame`.
    """
    turn, origin = frame[:3, :3], frame[:3, 3]
    mass = inertia[9]
    moment = turn @ inertia[6:9]
    tensor = np.zeros((3, 3))
    tensor[np.triu_indices(3)] = inertia[:6]
    tensor = turn @ (tensor + np.triu(tensor, 1).T) @ turn.T
    # J about another point: J + S(p) terms of the Huygens theorem for a body whose centre is not the origin
    cross = np.outer(origin, moment) + np.outer(moment, origin) + mass * np.outer(origin, origin)
    tensor += np.trace(cross) * np.eye(3) - cross
    return np.concatenate([tensor[np.triu_indices(3)], moment + mass * origin, [mass]])
