"""Tables, timetables and time series of MATLAB: objects that a MAT file keeps in a part of its own.

MathWorks does not document that part; its layout is known from public readers (mat-io, MatFileHandler), and is the same in
versions 5 and 7.3: one cell array, whose first cell says which object has which property in which further cell.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Fields = dict[str, Any]
"""A MATLAB structure or object by its fields. Any: they hold whatever MATLAB can store, and each is looked at before use."""

REFERENCE = 0xDD000000
"""The first number of a variable that refers to objects."""
_MOST_TIMES = 10
OFFSETS_AT = 8
NAMES_AT = {2: 32, 3: 40, 4: 40}
"""Version of the layout -> byte at which names begin."""


@dataclass(frozen=True)
class _Table:
    """One of the tables in the first cell, as rows of uint32."""

    numbers: NDArray[np.uint32]

    def rows(self, width: int) -> NDArray[np.uint32]:
        return self.numbers[: len(self.numbers) // width * width].reshape(-1, width)


class ObjectStore:
    """The objects of one file.

    cells : contents of the cell array; the first is the (K,) uint8 description of all objects

    Objects are handed out `_MOST_TIMES` each on average: since one may stand in several others, a small file could unfold to
    any number.

    Raises ValueError, IndexError: the description is not of this layout.
    """

    def __init__(self, cells: Sequence[Any]) -> None:
        self.cells = cells
        raw = np.asarray(cells[0], dtype=np.uint8).tobytes(order="F")
        numbers = np.frombuffer(raw[: len(raw) // 4 * 4], dtype="<u4")
        version, count = int(numbers[0]), int(numbers[1])
        names_at = NAMES_AT.get(version, 40)
        offsets = [int(value) for value in numbers[OFFSETS_AT // 4 : names_at // 4]]
        self.names = raw[names_at : offsets[0]].decode("utf-8", "replace").split("\0")[:count]
        parts = [np.frombuffer(raw[begin:end], dtype="<u4") for begin, end in itertools.pairwise(offsets[:5])]
        self.classes = _Table(parts[0]).rows(4)
        self.objects = _Table(parts[2]).rows(6)
        self.saved = _property_lists(parts[1])
        self.normal = _property_lists(parts[3])
        self._left = 100 + _MOST_TIMES * len(self.objects)

    def objects_of(self, reference: Any) -> list[tuple[str, Fields]]:
        """Class and properties of each object that a variable refers to; none if it refers to none."""
        if isinstance(reference, dict):
            return []
        numbers = np.asarray(reference).reshape(-1, order="F")
        if len(numbers) < 6 or int(numbers[0]) != REFERENCE:
            return []
        dimensions = int(numbers[1])
        first = 2 + dimensions
        return [self._object(int(identity)) for identity in numbers[first:-1]]

    def _object(self, identity: int) -> tuple[str, Fields]:
        self._left -= 1
        if self._left < 0:
            raise ValueError("objects hold each other again and again")
        class_id, _, _, saved, normal, _ = (int(value) for value in self.objects[identity])
        class_name = self._name(int(self.classes[class_id][1]))
        entries = self.saved[saved] if saved else self.normal[normal] if normal < len(self.normal) else []
        properties: Fields = {}
        for name, kind, value in entries:
            if kind == 1 and value + 2 < len(self.cells):
                properties[self._name(name)] = self.cells[value + 2]
            elif kind == 2:
                properties[self._name(name)] = np.array(float(value))
        return class_name, properties

    def _name(self, number: int) -> str:
        return self.names[number - 1] if 0 < number <= len(self.names) else ""


def is_reference(value: Any) -> bool:
    """Whether a value inside an object is itself a reference to objects, which stands there as plain numbers."""
    return (
        isinstance(value, np.ndarray)
        and value.dtype == np.uint32
        and value.size >= 6
        and int(value.flat[0]) == REFERENCE
    )


def _property_lists(numbers: NDArray[np.uint32]) -> list[list[tuple[int, int, int]]]:
    """Each object's properties as (name, kind of value, value), the list at 0 empty; padded to 8 bytes."""
    lists: list[list[tuple[int, int, int]]] = []
    at = 0
    while at < len(numbers):
        count = int(numbers[at])
        block = numbers[at + 1 : at + 1 + 3 * count]
        if len(block) < 3 * count:
            break
        lists.append([(int(a), int(b), int(c)) for a, b, c in block.reshape(-1, 3)])
        at += 1 + 3 * count
        at += at % 2
    return lists


def as_fields(class_name: str, properties: Fields) -> Fields | None:
    """The variables of a table, or time and data of a time series; None for objects of other classes.

    A timetable's row times are called Time, as MATLAB shows them.
    """
    if class_name == "table":
        return _variables(properties.get("varnames"), properties.get("data"))
    if class_name == "timetable":
        inside = properties.get("any", properties)
        if isinstance(inside, dict):
            fields = _variables(inside.get("varNames"), inside.get("data")) or {}
            return {"Time": inside.get("rowTimes")} | fields
    if class_name == "timeseries":
        time = next((properties[key] for key in ("Time_", "Time") if key in properties), None)
        data = next((properties[key] for key in ("Data_", "Data") if key in properties), None)
        return {"Time": time, "Data": data}
    return None


def _variables(names: Any, data: Any) -> Fields | None:
    if not isinstance(names, list) or not isinstance(data, list):
        return None
    return {str(name): value for name, value in zip(names, data, strict=False)}
