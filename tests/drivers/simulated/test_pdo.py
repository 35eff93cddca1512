"""When a PDO of a simulated drive is there, and when it goes with SYNC."""

import pytest

from drivers.simulated import process_image as slot
from drivers.simulated.pdo import PDO_OFF, Pdo

POSITION = (slot.POSITION, "i")


@pytest.mark.parametrize(
    ("cob_id", "slots", "valid"),
    [(0x181, [POSITION], True), (PDO_OFF | 0x181, [POSITION], False), (0x181, [], False)],
)
def test_a_pdo_is_there_when_it_is_switched_on_and_carries_something(cob_id, slots, valid):
    pdo = Pdo()
    pdo.load(cob_id, 1, slots)
    assert pdo.valid is valid
    assert pdo.can_id == 0x181


@pytest.mark.parametrize(
    ("transmission_type", "synchronous"), [(0, True), (240, True), (254, False), (255, False)]
)
def test_it_goes_with_sync_up_to_transmission_type_240(transmission_type, synchronous):
    pdo = Pdo()
    pdo.load(0x181, transmission_type, [POSITION])
    assert pdo.synchronous is synchronous


def test_what_was_on_its_way_is_gone_when_it_is_mapped_anew():
    pdo = Pdo()
    pdo.load(0x181, 1, [POSITION])
    pdo.received, pdo.last_sent, pdo.syncs = b"1234", b"1234", 3
    pdo.load(0x181, 1, [POSITION])
    assert (pdo.received, pdo.last_sent, pdo.syncs) == (None, None, 0)
