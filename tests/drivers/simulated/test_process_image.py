"""The image of a drive's objects against the types of CiA 301, CiA 402 and Python's struct."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.simulated import process_image
from drivers.simulated.process_image import SLOT_OF_OBJECT, SLOTS, MappedSlots, bits_of

# CiA 402-2: object -> signed, bits
OF_THE_STANDARD = {
    0x6040: (False, 16), 0x6041: (False, 16), 0x6060: (True, 8), 0x6061: (True, 8), 0x6064: (True, 32),
    0x6062: (True, 32), 0x606C: (True, 32), 0x606B: (True, 32), 0x6077: (True, 16), 0x6074: (True, 16),
    0x6078: (True, 16), 0x60F4: (True, 32), 0x607A: (True, 32), 0x60FF: (True, 32), 0x6071: (True, 16),
    0x60C1: (True, 32), 0x60B0: (True, 32), 0x60B1: (True, 32), 0x60B2: (True, 16), 0x603F: (False, 16),
    0x1001: (False, 8),
}  # fmt: skip


@pytest.mark.parametrize("index", OF_THE_STANDARD)
def test_an_object_has_the_standard_s_type(index):
    signed, bits = OF_THE_STANDARD[index]
    subindex = 1 if index == 0x60C1 else 0
    _, kind = SLOT_OF_OBJECT[index, subindex]
    assert bits_of(kind) == bits == 8 * struct.calcsize(f"<{kind}")
    assert kind.islower() is signed


def test_every_object_has_a_slot_of_its_own():
    slots = [slot for slot, _ in SLOT_OF_OBJECT.values()]
    assert sorted(slots) == list(range(SLOTS))
    assert SLOT_OF_OBJECT[0x6064, 0][0] == process_image.POSITION
    assert SLOT_OF_OBJECT[0x6077, 0][0] == process_image.TORQUE


@given(
    chosen=st.lists(st.sampled_from(sorted(SLOT_OF_OBJECT)), min_size=1, max_size=6, unique=True),
    data=st.data(),
)
def test_what_is_packed_is_unpacked_little_endian_without_gaps(chosen, data):
    mapping = [SLOT_OF_OBJECT[each] for each in chosen]
    image = [0] * SLOTS
    for slot, kind in mapping:
        half = 1 << (bits_of(kind) - 1)
        image[slot] = data.draw(
            st.integers(-half, half - 1) if kind.islower() else st.integers(0, 2 * half - 1)
        )
    mapped = MappedSlots(mapping)
    packed = mapped.pack(image)
    expected = b"".join(
        image[slot].to_bytes(bits_of(kind) // 8, "little", signed=kind.islower()) for slot, kind in mapping
    )
    assert packed == expected
    other = [0] * SLOTS
    mapped.unpack(packed + b"\xff", other)  # a longer frame is read as far as it is mapped
    assert other == image
    with pytest.raises(struct.error):
        mapped.unpack(packed[:-1], other)
