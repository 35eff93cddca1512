"""The output that takes the power away: what it writes, what is refused in its settings, and that a cut uses it."""

import pytest
from pydantic import ValidationError

from drivers.errors import BusError
from drivers.safety_output import SafetyOutput, SafetyOutputSettings


def nothing(_can_id: int, _data: bytes) -> None:
    raise AssertionError("nothing was to be sent")


def test_a_device_is_opened_beforehand_and_written_to(tmp_path):
    device = tmp_path / "relay"
    device.write_bytes(b"")
    output = SafetyOutput(SafetyOutputSettings(path=str(device), write="A00101A2"), nothing)
    assert device.read_bytes() == b""
    device.unlink()
    (tmp_path / "relay").symlink_to(tmp_path / "elsewhere")  # what was opened counts, not the name
    output.cut()
    output.close()
    output.close()
    assert not (tmp_path / "elsewhere").exists()


def test_the_bytes_are_those_of_the_rig_file(tmp_path):
    device = tmp_path / "relay"
    device.write_bytes(b"")
    output = SafetyOutput(SafetyOutputSettings(path=str(device), write="30"), nothing)
    output.cut()
    output.cut()
    output.close()
    assert device.read_bytes() == b"00"


def test_a_frame_goes_out_on_the_bus():
    sent = []
    output = SafetyOutput(
        SafetyOutputSettings(can_id=0x201, data="00ff"), lambda can_id, data: sent.append((can_id, data))
    )
    output.cut()
    output.close()
    assert sent == [(0x201, b"\x00\xff")]


def test_a_device_that_is_not_there_or_refuses_is_named(tmp_path):
    with pytest.raises(BusError, match="cannot be opened"):
        SafetyOutput(SafetyOutputSettings(path=str(tmp_path / "none"), write="30"), nothing)
    full = SafetyOutput(SafetyOutputSettings(path="/dev/full", write="30"), nothing)
    with pytest.raises(BusError, match="/dev/full refused"):
        full.cut()
    full.close()


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({}, "name either"),
        ({"path": "/dev/ttyUSB0", "write": "30", "can_id": 1}, "name either"),
        ({"path": "/dev/ttyUSB0"}, "write"),
        ({"path": "/dev/ttyUSB0", "write": "3"}, "write"),
        ({"can_id": 0x800}, "can_id"),
        ({"can_id": 1, "data": "00" * 9}, "data"),
    ],
)
def test_settings_that_cut_nothing_are_refused(settings, said):
    with pytest.raises(ValidationError, match=said):
        SafetyOutputSettings(**settings)


@pytest.mark.parametrize("digits", ["A", "0x30", "30 31", "GG", "é"])
def test_bytes_that_are_none_are_refused_in_words(digits):
    for given in ({"path": "/dev/null", "write": digits}, {"can_id": 0x201, "data": digits}):
        with pytest.raises(ValidationError, match="pairs of hexadecimal digits"):
            SafetyOutputSettings.model_validate(given)
