"""Our master against a slave that we did not write: durand, on the virtual bus, on UDP multicast, and on vcan0."""

import itertools
import uuid

import can
import numpy as np
import pytest

from drivers.bus import BusSettings, check_network_interface, pass_ids
from drivers.canopen_network import CanopenNetwork
from drivers.cia402 import Mode, State
from drivers.drive import Drive, Timeouts
from drivers.errors import BusError, DriveError
from drivers.frames import column
from drivers.receive_python_can import PythonCanReceiver
from drivers.receive_socketcan import SocketCanReceiver
from drivers.scan import scan
from drivers.sync_producer import SYNC_ID
from tests.drivers.foreign_stacks.durand_drive import DurandDrive

NODE = 11
TIMEOUTS = Timeouts(sdo=0.5, retries=1, transition=3.0, mode=3.0, nmt=3.0, boot=3.0)
_ports = itertools.count(43_200)


@pytest.fixture(params=["virtual", "udp_multicast", "socketcan"])
def settings(request):
    if request.param == "virtual":
        return BusSettings(interface="virtual", channel=f"durand-{uuid.uuid4()}")
    if request.param == "udp_multicast":
        return BusSettings(
            interface="udp_multicast", channel="239.74.163.2", options={"port": next(_ports), "hop_limit": 0}
        )
    try:
        check_network_interface("vcan0")
    except BusError as error:
        pytest.skip(f"{error}; run through tests/with-vcan")
    return BusSettings(interface="socketcan", channel="vcan0")


@pytest.fixture
def foreign(settings):
    bus = can.Bus(
        interface=settings.interface, channel=settings.channel, ignore_config=True, **settings.options
    )
    drive = DurandDrive(bus, NODE)
    yield drive
    drive.close()


@pytest.fixture
def network(settings, foreign):
    with CanopenNetwork(settings) as opened:
        yield opened


@pytest.fixture
def drive(network):
    return Drive(network, NODE, timeouts=TIMEOUTS)


def brought_up(drive, mode=Mode.CYCLIC_SYNCHRONOUS_POSITION):
    drive.produce_heartbeat(0.05)
    stream = drive.map_stream(mode)
    drive.set_cycle(0.004)
    drive.set_nmt_state("OPERATIONAL")
    drive.set_mode(mode)
    drive.enable()
    return stream


def test_identity_oddities_and_objects_are_read_by_sdo(drive):
    identity = drive.identity()
    assert (identity.vendor, identity.product, identity.profile) == (0x1234, 0x77, 402)
    assert drive.position() == 1000
    assert drive.rated_value() == pytest.approx(2.5)
    assert any("has no heartbeat consumer (0x1016)" in words for words in drive.oddities())
    with pytest.raises(DriveError, match=r"0x5FFF:00.*does not exist"):
        drive.sdo.read(0x5FFF, 0, "uint8")
    with pytest.raises(DriveError, match=r"the drive refused"):
        drive.sdo.write(0x6064, 0, "int32", 5, "writing the position")


def test_a_scan_finds_it(settings, foreign):
    (found,) = scan(settings, wait=1.0, nodes=range(NODE - 1, NODE + 2))
    assert (found.node, found.vendor, found.profile) == (NODE, 0x1234, 402)


def test_it_is_mapped_enabled_and_streams_position_and_command_at_every_sync(drive, settings, foreign):
    stream = brought_up(drive)
    assert drive.state() is State.OPERATION_ENABLED
    if settings.interface == "socketcan":
        receiver = SocketCanReceiver(settings.channel, pass_ids([SYNC_ID, *stream.transmit_ids]))
    else:
        receiver = PythonCanReceiver(settings)
    receiver.open()
    position, entry = stream.find("position")
    command_pdo, command_entry = stream.find("command")
    targets = [1000 + 7 * k for k in range(1, 41)]
    frames = []
    try:
        for target in targets:
            receiver.send(stream.receive.can_id, stream.setpoint(0x0F, target))
            receiver.send(SYNC_ID, b"")
            answered = 0
            for _attempt in range(200):
                frames.append(receiver.read())
                answered += np.isin(frames[-1]["can_id"], stream.transmit_ids).sum()
                if answered >= len(stream.transmit_ids):
                    break
                receiver.wait(0.01)
            assert answered == len(stream.transmit_ids)
    finally:
        receiver.close()
    received = np.concatenate(frames)
    positions = column(received[received["can_id"] == position.can_id], entry.byte_offset, entry.kind)
    commands = column(
        received[received["can_id"] == command_pdo.can_id], command_entry.byte_offset, command_entry.kind
    )
    np.testing.assert_array_equal(np.diff(positions[-39:]), 7)
    np.testing.assert_array_equal(commands[-38:], 7)
    assert foreign.syncs == len(targets)
    drive.disable()
    assert drive.state() is State.SWITCH_ON_DISABLED


def test_emcy_fault_and_its_reset(drive, foreign):
    brought_up(drive)
    foreign.fail(0x3210, 0x05)
    assert drive.watch.wait_for(lambda: bool(drive.emergencies), 3.0)
    assert (drive.emergencies[-1].code, drive.emergencies[-1].register) == (0x3210, 0x05)
    with pytest.raises(
        DriveError, match=r"in FAULT: 0x3210 DC link over-voltage.*error register: generic error"
    ):
        drive.enable()
    drive.reset_fault()
    drive.enable()
    assert drive.state() is State.OPERATION_ENABLED


def test_network_states_are_confirmed_by_its_heartbeat_and_a_reset_by_its_boot_up(drive):
    brought_up(drive)
    drive.set_nmt_state("STOPPED")
    with pytest.raises(DriveError, match=r"no answer within 0\.5 s"):
        drive.sdo.read(0x1000, 0, "uint32")
    drive.set_nmt_state("PRE-OPERATIONAL")
    drive.reset_node()
    assert drive.state() is State.SWITCH_ON_DISABLED
