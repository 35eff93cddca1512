"""A robot's links and joints as a URDF's tree of elements, made from files that say the same otherwise."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.rotations import roll_pitch_yaw
from identify.recording.errors import InputError

Array = NDArray[np.float64]


class RobotTree:
    """Collects links and joints; `root` is the URDF."""

    def __init__(self, name: str) -> None:
        self.root = ElementTree.Element("robot", {"name": name})
        self.remarks: list[str] = []

    def link(
        self,
        name: str,
        *,
        mass: float = 0.0,
        placement: Array | None = None,
        tensor: Array | None = None,
    ) -> None:
        """A link.

        placement : (4, 4) of the axes of `tensor`, at the centre of mass, in the link's frame
        tensor    : (3, 3) kg m^2 about the centre of mass; None for a link without a body
        """
        link = ElementTree.SubElement(self.root, "link", {"name": name})
        if tensor is None or placement is None:
            return
        inertial = ElementTree.SubElement(link, "inertial")
        _origin(inertial, placement)
        ElementTree.SubElement(inertial, "mass", {"value": repr(float(mass))})
        entries = {f"i{'xyz'[i]}{'xyz'[j]}": repr(float(tensor[i, j])) for i in range(3) for j in range(i, 3)}
        ElementTree.SubElement(inertial, "inertia", entries)

    def joint(
        self,
        name: str,
        kind: str,
        parent: str,
        child: str,
        placement: Array,
        *,
        axis: Sequence[float] = (1.0, 0.0, 0.0),
        limits: tuple[float, float] | None = None,
        speed: float | None = None,
        mimics: str | None = None,
    ) -> None:
        """A joint; placement (4, 4) is its frame in that of the parent link, limits in rad or m."""
        joint = ElementTree.SubElement(self.root, "joint", {"name": name, "type": kind})
        ElementTree.SubElement(joint, "parent", {"link": parent})
        ElementTree.SubElement(joint, "child", {"link": child})
        _origin(joint, placement)
        ElementTree.SubElement(joint, "axis", {"xyz": _text(axis)})
        stated: dict[str, str] = {}
        if limits is not None:
            stated |= {"lower": repr(float(limits[0])), "upper": repr(float(limits[1]))}
        if speed is not None:
            stated["velocity"] = repr(float(speed))
        if stated:
            ElementTree.SubElement(joint, "limit", stated)
        if mimics is not None:
            ElementTree.SubElement(joint, "mimic", {"joint": mimics})


def numbers(path: Path, owner: str, what: str, text: str, count: int) -> Array:
    """(count,) numbers of a text.

    Raises InputError: it holds others, or not so many.
    """
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.isfinite(values).all():
        wanted = "a number" if count == 1 else f"{count} numbers"
        raise InputError(f"{path}: '{owner}': {what} '{' '.join(text.split())[:80]}' must be {wanted}")
    return values


def placed(position: Array, rotation: Array) -> Array:
    """(4, 4) of a position and a rotation."""
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = rotation, position
    return frame


def _origin(element: ElementTree.Element, placement: Array) -> None:
    angles = roll_pitch_yaw(placement[:3, :3])
    ElementTree.SubElement(element, "origin", {"xyz": _text(placement[:3, 3]), "rpy": _text(angles)})


def _text(values: Sequence[float] | Array) -> str:
    return " ".join(repr(float(value)) for value in values)
