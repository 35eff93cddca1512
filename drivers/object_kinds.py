"""Types of objects by the names that profiles use."""

from typing import Literal

ObjectType = Literal["int8", "int16", "int32", "uint8", "uint16", "uint32", "float32"]

OBJECT_KINDS: dict[ObjectType, str] = {
    "int8": "<i1",
    "int16": "<i2",
    "int32": "<i4",
    "uint8": "<u1",
    "uint16": "<u2",
    "uint32": "<u4",
    "float32": "<f4",
}
"""NumPy's names of the types, little-endian"""
