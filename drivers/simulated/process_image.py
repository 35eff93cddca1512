"""The objects that a simulated drive reads and writes in its own rhythm.

They live in one plain list per drive, a slot each, so that a PDO is packed from and unpacked into it
without a look-up in canopen's dictionary; SDO reaches the same slots.
"""

from operator import itemgetter
from struct import Struct

CONTROLWORD = 0
STATUSWORD = 1
MODE = 2
MODE_DISPLAY = 3
POSITION = 4
POSITION_DEMAND = 5
VELOCITY = 6
VELOCITY_DEMAND = 7
TORQUE = 8
TORQUE_DEMAND = 9
CURRENT = 10
FOLLOWING_ERROR = 11
TARGET_POSITION = 12
TARGET_VELOCITY = 13
TARGET_TORQUE = 14
INTERPOLATION_DATA = 15
POSITION_OFFSET = 16
VELOCITY_OFFSET = 17
TORQUE_OFFSET = 18
ERROR_CODE = 19
ERROR_REGISTER = 20
TEMPERATURE = 21
SLOTS = 22

# (index, subindex) -> (slot, struct's type)
SLOT_OF_OBJECT: dict[tuple[int, int], tuple[int, str]] = {
    (0x6040, 0): (CONTROLWORD, "H"),
    (0x6041, 0): (STATUSWORD, "H"),
    (0x6060, 0): (MODE, "b"),
    (0x6061, 0): (MODE_DISPLAY, "b"),
    (0x6064, 0): (POSITION, "i"),
    (0x6062, 0): (POSITION_DEMAND, "i"),
    (0x606C, 0): (VELOCITY, "i"),
    (0x606B, 0): (VELOCITY_DEMAND, "i"),
    (0x6077, 0): (TORQUE, "h"),
    (0x6074, 0): (TORQUE_DEMAND, "h"),
    (0x6078, 0): (CURRENT, "h"),
    (0x60F4, 0): (FOLLOWING_ERROR, "i"),
    (0x607A, 0): (TARGET_POSITION, "i"),
    (0x60FF, 0): (TARGET_VELOCITY, "i"),
    (0x6071, 0): (TARGET_TORQUE, "h"),
    (0x60C1, 1): (INTERPOLATION_DATA, "i"),
    (0x60B0, 0): (POSITION_OFFSET, "i"),
    (0x60B1, 0): (VELOCITY_OFFSET, "i"),
    (0x60B2, 0): (TORQUE_OFFSET, "h"),
    (0x603F, 0): (ERROR_CODE, "H"),
    (0x1001, 0): (ERROR_REGISTER, "B"),
    (0x2000, 0): (TEMPERATURE, "h"),
}

_BITS = {"b": 8, "B": 8, "h": 16, "H": 16, "i": 32, "I": 32}


def bits_of(kind: str) -> int:
    """Length of a slot's object in bits."""
    return _BITS[kind]


class MappedSlots:
    """A PDO's mapping, compiled: packs slots into a frame's data, or a frame's data into slots."""

    def __init__(self, mapping: list[tuple[int, str]]):
        self.slots = tuple(slot for slot, _ in mapping)
        self.struct = Struct("<" + "".join(kind for _, kind in mapping))
        self._pick = itemgetter(*self.slots) if len(self.slots) > 1 else None

    def pack(self, image: list[int]) -> bytes:
        """The frame's data."""
        if self._pick is not None:
            return self.struct.pack(*self._pick(image))
        return self.struct.pack(*(image[slot] for slot in self.slots))

    def unpack(self, data: bytes, image: list[int]) -> None:
        """Take a frame's data; raises struct.error when it is too short."""
        for slot, value in zip(self.slots, self.struct.unpack_from(data), strict=True):
            image[slot] = value
