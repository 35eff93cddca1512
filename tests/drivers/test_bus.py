import pytest
from pydantic import ValidationError

from drivers import bus
from drivers.bus import BusSettings, check_network_interface, open_bus
from drivers.errors import BusError


def test_an_interface_that_is_not_there_is_named_with_those_that_are():
    with pytest.raises(BusError, match="CAN interface 'can99' is not there; this machine has"):
        open_bus(BusSettings(interface="socketcan", channel="can99"))


def test_a_network_interface_that_is_not_can_is_refused():
    with pytest.raises(BusError, match="'lo' is not a CAN interface"):
        check_network_interface("lo")


def test_an_interface_that_is_down_is_said_to_be_down(tmp_path, monkeypatch):
    can0 = tmp_path / "can0"
    can0.mkdir()
    (can0 / "type").write_text("280\n")
    (can0 / "flags").write_text("0x40080\n")
    monkeypatch.setattr(bus, "NETWORK_CLASSES", tmp_path)
    with pytest.raises(BusError, match="'can0' is down; bring it up: ip link set can0"):
        check_network_interface("can0")
    (can0 / "flags").write_text("0x40081\n")
    check_network_interface("can0")


def test_an_interface_that_python_can_does_not_know_is_refused_in_words():
    with pytest.raises(BusError, match="no-such-interface"):
        open_bus(BusSettings(interface="no-such-interface", channel="x"))


def test_a_serial_adapter_that_is_not_there_is_refused_in_words():
    with pytest.raises(BusError, match=r"slcan channel /dev/not-there: the channel is not there"):
        open_bus(BusSettings(interface="slcan", channel="/dev/not-there"))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"bitrate": 0}, "bitrate"),
        ({"data_bitrate": 5_000_000}, "set fd: true"),
        ({"speed": 1}, "speed"),
    ],
)
def test_wrong_settings_name_the_field(fields, message):
    with pytest.raises(ValidationError, match=message):
        BusSettings(**fields)
