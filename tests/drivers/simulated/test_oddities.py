"""Which objects an odd drive does not have, and which it lets nobody write."""

import pytest
from pydantic import ValidationError

from drivers.simulated.oddities import OdditySettings

EVERY_PDO = [first + number for first in (0x1400, 0x1600, 0x1800, 0x1A00) for number in range(4)]


def lacking(settings, *indices):
    return [index for index in indices if settings.lacks(index, 1)]


def test_a_usual_drive_has_everything_and_takes_everything():
    usual = OdditySettings()
    assert not lacking(usual, 0x1016, 0x1017, *EVERY_PDO)
    assert not any(usual.refuses(index, 1) for index in (0x60C2, *EVERY_PDO))
    assert not list(usual.fixed_pdo_objects(5))


def test_objects_are_missing_with_all_their_subindices_or_one_of_them():
    odd = OdditySettings(missing=("0x6076", "0x60C2:02"))
    assert [odd.lacks(0x6076, 0), odd.lacks(0x60C2, 2), odd.lacks(0x60C2, 1)] == [True, True, False]


def test_of_two_receive_pdos_the_other_two_are_missing():
    assert lacking(OdditySettings(receive_pdos=2), *EVERY_PDO) == [0x1402, 0x1403, 0x1602, 0x1603]


def test_a_guarded_drive_has_no_heartbeat_of_either_kind():
    assert lacking(OdditySettings(node_guarding_only=True), 0x1016, 0x1017) == [0x1016, 0x1017]
    assert lacking(OdditySettings(no_heartbeat_consumer=True), 0x1016, 0x1017) == [0x1016]


def test_what_can_only_be_read():
    assert all(OdditySettings(fixed_pdos=True).refuses(index, 1) for index in EVERY_PDO)
    assert OdditySettings(fixed_interpolation=2).refuses(0x60C2, 1)
    odd = OdditySettings(read_only=("0x60C2:02",))
    assert [odd.refuses(0x60C2, 1), odd.refuses(0x60C2, 2)] == [False, True]


def test_an_address_that_is_none_is_refused():
    with pytest.raises(ValidationError, match="four hexadecimal digits of an index, such as 0x60C2"):
        OdditySettings(missing=("6076",))
