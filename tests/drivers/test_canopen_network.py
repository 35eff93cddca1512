"""canopen's side of a bus that goes away."""

import threading

import pytest

from drivers import canopen_network
from drivers.bus import BusSettings, open_bus
from drivers.canopen_network import CanopenNetwork
from drivers.errors import BusError


def test_a_bus_that_goes_away_is_told_to_who_sends_next_and_prints_no_traceback(monkeypatch):
    printed, seen = [], threading.Event()
    monkeypatch.setattr(threading, "excepthook", printed.append)
    monkeypatch.setattr(canopen_network.time, "sleep", lambda _: seen.set())
    settings = BusSettings(interface="virtual", channel="a-bus-that-goes-away")
    with open_bus(settings) as member, CanopenNetwork(settings) as network:
        member.fail("the adapter is gone")
        assert seen.wait(10.0)
        with pytest.raises(BusError, match="the adapter is gone"):
            network.send(0, b"\x80\x05")
    assert printed == []
