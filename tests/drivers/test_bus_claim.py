"""One user of a bus at a time, across processes, and none that is dead."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from drivers.bus import BusSettings
from drivers.bus_claim import BusClaim, BusInUse, user_of

ROOT = Path(__file__).parents[2]
HOLD = """
import sys
from drivers.bus import BusSettings
from drivers.bus_claim import BusClaim
with BusClaim(BusSettings(interface="socketcan", channel=sys.argv[1]), "a test"):
    print("held", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def bus(tmp_path) -> BusSettings:
    """A channel that no other test names."""
    return BusSettings(interface="socketcan", channel=f"can-{os.getpid()}-{tmp_path.name}")


@pytest.fixture
def holder(bus):
    """Another process that has the bus."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, bus.channel],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.wait()
    process.stdin.close()
    process.stdout.close()


def test_the_second_process_is_refused_and_told_who_has_the_bus(bus, holder):
    with pytest.raises(BusInUse) as refused:
        BusClaim(bus, "another test")
    assert f"process {holder.pid}" in str(refused.value)
    assert "user " in str(refused.value)
    assert "nothing was sent to it" in str(refused.value)


def test_who_uses_a_bus_is_said_without_taking_it(bus, holder):
    assert f"process {holder.pid}" in (user_of(bus) or "")
    holder.kill()
    holder.wait()
    assert user_of(bus) is None
    with BusClaim(bus, "a session"):
        assert user_of(bus) == "this process (a session)"
    assert user_of(bus) is None


@pytest.mark.parametrize("way", [signal.SIGKILL, signal.SIGTERM])
def test_a_process_that_died_holds_nothing(bus, holder, way):
    holder.send_signal(way)
    holder.wait()
    BusClaim(bus, "another test").close()


def test_it_is_given_back_and_taken_again_within_a_process(bus):
    with BusClaim(bus, "a session"), pytest.raises(BusInUse, match=r"this process \(a session\)"):
        BusClaim(bus, "homing")
    with BusClaim(bus, "homing"):
        pass


def test_two_names_of_one_adapter_are_one_bus(tmp_path):
    device, alias = tmp_path / "ttyACM0", tmp_path / "by-id"
    device.touch()
    alias.symlink_to(device)
    with BusClaim(BusSettings(interface="slcan", channel=str(device)), "a session"), pytest.raises(BusInUse):
        BusClaim(BusSettings(interface="slcan", channel=str(alias)), "a scan")


def test_virtual_buses_of_two_processes_have_nothing_to_do_with_each_other():
    virtual = BusSettings(interface="virtual", channel="x")
    with BusClaim(virtual, "a session"), BusClaim(virtual, "another"):
        pass
