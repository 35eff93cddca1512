"""MAT files of version 5 to 7, element by element.

SciPy's reader is quicker, but it ends the whole process on some damaged files, and it cannot open tables and time series,
which MATLAB keeps in a part of the file of their own (`matlab_objects.py`). Source of the layout: MathWorks, "MAT-File Format",
R2023b, chapter 1.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.recording.foreign.matlab_objects import Fields

NUMBERS = {
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    9: "f8",
    12: "i8",
    13: "u8",
    16: "u1",
    17: "u2",
    18: "u4",
}
"""Type of a data element -> NumPy's name, without byte order."""
MATRIX, COMPRESSED = 14, 15
CELL, STRUCT, OBJECT, CHAR, SPARSE, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, 16, 17
COMPLEX = 0x0800
MOST_ELEMENTS = 1 << 31
_SHORTEST = 8
"""Bytes of the shortest data element, its tag alone."""
DEEPEST = 30
"""Structs within structs."""


class Damaged(ValueError):
    """The file does not hold what its own numbers say."""


@dataclass(frozen=True)
class Reference:
    """A variable whose content lies in the file's part for objects."""

    class_name: str
    content: Any
    """uint32 array that names the objects; the cells of all values for the part for objects itself"""


class Mat5:
    """The variables of one file."""

    def __init__(self, content: bytes) -> None:
        if len(content) < 136:
            raise Damaged("cut short")
        mark = content[126:128]
        if mark not in (b"IM", b"MI"):
            raise Damaged("no mark of a byte order")
        self.order = "<" if mark == b"IM" else ">"
        self._content = content
        (self._subsystem_at,) = struct.unpack(self.order + "Q", content[116:124])

    def variables(self) -> Iterator[tuple[str, Any]]:
        """Names and values: arrays, text, dicts of structs (lists of them), lists of cells, references."""
        at = 128
        while at + 8 <= len(self._content):
            begin = at
            kind, data, at = self._element(memoryview(self._content), at)
            if begin == self._subsystem_at:
                continue
            if kind == COMPRESSED:
                kind, data, _end = self._element(memoryview(_inflated(data)), 0)
            if kind == MATRIX:
                yield self._matrix(data)

    def subsystem(self) -> Any:
        """The value of the file's part for objects; None if there is none."""
        if not 128 <= self._subsystem_at < len(self._content) - 8:
            return None
        kind, data, _end = self._element(memoryview(self._content), self._subsystem_at)
        if kind == COMPRESSED:
            kind, data, _end = self._element(memoryview(_inflated(data)), 0)
        _name, raw = self._matrix(data)
        inner = memoryview(np.asarray(raw).astype(np.uint8).tobytes(order="F"))
        kind, data, _end = self._element(inner, 8)
        if kind == COMPRESSED:
            kind, data, _end = self._element(memoryview(_inflated(data)), 0)
        return self._matrix(data)[1]

    def _element(self, data: memoryview, at: int) -> tuple[int, memoryview, int]:
        """Type and bytes of the element at a place, and the place of the next."""
        if at + 8 > len(data):
            raise Damaged("cut short")
        (first,) = struct.unpack_from(self.order + "I", data, at)
        if first >> 16:
            size = first >> 16
            if size > 4:
                raise Damaged("a small element is too large")
            return first & 0xFFFF, data[at + 4 : at + 4 + size], at + 8
        (size,) = struct.unpack_from(self.order + "I", data, at + 4)
        end = at + 8 + size
        if end > len(data):
            raise Damaged("cut short")
        return first, data[at + 8 : end], end if first == COMPRESSED else end + (-size) % 8

    def _numbers(self, data: memoryview, at: int) -> tuple[NDArray[Any], int]:
        kind, part, at = self._element(data, at)
        if kind not in NUMBERS:
            raise Damaged(f"an element of type {kind} where numbers belong")
        kind_of_number = np.dtype(self.order + NUMBERS[kind])
        return np.frombuffer(part, kind_of_number, len(part) // kind_of_number.itemsize), at

    def _matrix(self, data: memoryview, depth: int = 0) -> tuple[str, Any]:
        if depth > DEEPEST:
            raise Damaged("structs too deep")
        if not len(data):
            return "", np.empty((0, 0))
        flags, at = self._numbers(data, 0)
        if not len(flags):
            raise Damaged("an array without flags")
        kind, is_complex = int(flags[0]) & 0xFF, bool(int(flags[0]) & COMPLEX)
        if kind == OPAQUE:
            name, at = self._text(data, at)
            _system, at = self._text(data, at)
            class_name, at = self._text(data, at)
            _kind, part, at = self._element(data, at)
            return name, Reference(class_name, self._matrix(part, depth + 1)[1])
        dimensions, at = self._numbers(data, at)
        shape = tuple(int(size) for size in dimensions)
        count = int(np.prod(shape, dtype=object)) if shape else 0
        if count > MOST_ELEMENTS or count < 0:
            raise Damaged(f"an array of {count} elements")
        name, at = self._text(data, at)
        if kind == CELL:
            return name, self._cells(data, at, count, depth)
        if kind in (STRUCT, OBJECT):
            if kind == OBJECT:
                _class, at = self._text(data, at)
            return name, self._structs(data, at, count, depth)
        if kind == CHAR:
            _kind, part, at = self._element(data, at)
            wide = _kind in (4, 17)
            encoding = ("utf-16-le" if self.order == "<" else "utf-16-be") if wide else "utf-8"
            return name, bytes(part).decode(encoding, errors="replace")
        if kind in (SPARSE, FUNCTION) or not 6 <= kind <= 15:
            return name, None
        real, at = self._numbers(data, at)
        if len(real) != count:
            raise Damaged(f"{len(real)} numbers for an array of {count}")
        values: NDArray[Any] = real.reshape(shape, order="F")
        if is_complex:
            return name, None
        return name, values if kind not in (6, 7) else values.astype(np.float64)

    def _text(self, data: memoryview, at: int) -> tuple[str, int]:
        _kind, part, at = self._element(data, at)
        return bytes(part).decode("utf-8", errors="replace"), at

    def _cells(self, data: memoryview, at: int, count: int, depth: int) -> list[Any]:
        _refuse_more_than_there_is(data, at, count)
        cells = []
        for _ in range(count):
            kind, part, at = self._element(data, at)
            if kind != MATRIX:
                raise Damaged("a cell that is no array")
            cells.append(self._matrix(part, depth + 1)[1])
        return cells

    def _structs(self, data: memoryview, at: int, count: int, depth: int) -> Any:
        lengths, at = self._numbers(data, at)
        _kind, part, at = self._element(data, at)
        length = int(lengths[0]) if len(lengths) else 0
        if length < 1:
            return {}
        raw = bytes(part)
        names = [
            raw[k : k + length].split(b"\0")[0].decode("utf-8", "replace") for k in range(0, len(raw), length)
        ]
        _refuse_more_than_there_is(data, at, count * len(names))
        if not names:
            return {}
        structs: list[Fields] = []
        for _ in range(count):
            fields: Fields = {}
            for name in names:
                kind, part, at = self._element(data, at)
                if kind != MATRIX:
                    raise Damaged("a field that is no array")
                fields[name] = self._matrix(part, depth + 1)[1]
            structs.append(fields)
        return structs[0] if len(structs) == 1 else structs


def _refuse_more_than_there_is(data: memoryview, at: int, elements: int) -> None:
    """Refuse a count of elements that the bytes left cannot hold, before any of them is made."""
    if elements > (len(data) - at) // _SHORTEST:
        raise Damaged(f"{elements} elements in {len(data) - at} bytes")


def _inflated(data: memoryview) -> bytes:
    try:
        return zlib.decompressobj().decompress(data)
    except zlib.error as error:
        raise Damaged(f"compressed data damaged ({error})") from None
