"""Our simulated drive under a master that we did not write: canopen's CiA 402 node, with its own SDO, PDO and NMT.

Our own master uses canopen's SDO client, but none of what is used here: its state machine, its PDO maps, its EMCY
consumer, its heartbeat and its SYNC producer.
"""

import threading
from importlib.resources import files

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

NODE = 5


@pytest.fixture
def bench(open_bench):
    return open_bench()


@pytest.fixture
def node(bench):
    network = canopen.Network()
    network.connect(interface="virtual", channel=bench.bus.channel)
    eds = files("config") / "drives" / "simulated.eds"
    foreign = network.add_node(BaseNode402(NODE, str(eds)))
    foreign.sdo.RESPONSE_TIMEOUT = 2.0
    foreign.TIMEOUT_CHECK_TPDO = foreign.TIMEOUT_SWITCH_STATE_SINGLE = 3.0
    foreign.TIMEOUT_SWITCH_OP_MODE = foreign.TIMEOUT_SWITCH_STATE_FINAL = 5.0
    yield foreign
    network.sync.stop()
    network.disconnect()


def mapped(node):
    """Status, position and torque at every SYNC; controlword and target by event."""
    node.nmt.state = "PRE-OPERATIONAL"
    node.tpdo.read()
    node.rpdo.read()
    for pdo in [*node.tpdo.values(), *node.rpdo.values()]:
        pdo.enabled = False
    send = node.tpdo[1]
    send.clear()
    for index in (0x6041, 0x6064, 0x6074):
        send.add_variable(index)
    send.trans_type, send.enabled = 1, True
    take = node.rpdo[1]
    take.clear()
    for index in (0x6040, 0x607A):
        take.add_variable(index)
    take.trans_type, take.enabled = 255, True
    node.tpdo.save()
    node.rpdo.save()


def test_sdo_by_expedited_segmented_and_block_transfer(node, bench):
    assert node.sdo[0x1000].raw & 0xFFFF == 402
    assert node.sdo[0x1018][2].raw == 0x402
    name = node.sdo[0x1008].raw
    assert len(name) > 4
    node.sdo[0x607C].raw = -77
    assert node.sdo[0x607C].raw == -77
    with pytest.raises(canopen.SdoAbortedError) as refused:
        node.sdo.upload(0x5FFF, 0)
    assert refused.value.code == 0x0602_0000
    with pytest.raises(canopen.SdoAbortedError) as refused:
        node.sdo.download(0x6064, 0, bytes(4))
    assert refused.value.code == 0x0601_0002
    with pytest.raises(canopen.SdoAbortedError) as refused:
        node.sdo.download(0x607C, 0, bytes(2))
    assert refused.value.code in (0x0607_0010, 0x0607_0013)


def test_nmt_heartbeat_and_boot_up(node):
    node.sdo[0x1017].raw = 20
    node.nmt.state = "OPERATIONAL"
    assert node.nmt.wait_for_heartbeat(3) == "OPERATIONAL"
    node.nmt.state = "STOPPED"
    assert node.nmt.wait_for_heartbeat(3) == "STOPPED"
    node.nmt.send_command(0x81)
    node.nmt.wait_for_bootup(3)


def test_the_state_machine_over_pdos_and_motion_at_the_foreign_sync(node):
    mapped(node)
    node.sdo[0x1006].raw = 2000
    node.sdo[0x60C2][1].raw = 2
    node.nmt.state = "OPERATIONAL"
    network = node.network
    node.setup_402_state_machine()
    network.sync.start(0.005)
    assert node.tpdo[1].wait_for_reception(3) is not None
    assert node.state == "SWITCH ON DISABLED"
    node.op_mode = "CYCLIC SYNCHRONOUS POSITION"
    start = node.sdo[0x6064].raw
    node.rpdo[1][0x607A].raw = start
    node.state = "OPERATION ENABLED"
    assert node.state == "OPERATION ENABLED"
    for step in range(1, 101):
        node.rpdo[1][0x607A].raw = start + 3 * step
        node.rpdo[1].transmit()
        assert node.tpdo[1].wait_for_reception(3) is not None
    for _settling in range(60):
        assert node.tpdo[1].wait_for_reception(3) is not None
    assert node.tpdo[1][0x6064].raw == pytest.approx(start + 300, abs=30)
    node.state = "SWITCH ON DISABLED"
    assert node.sdo[0x6041].raw & 0x4F == 0x40


def test_emcy_and_fault_are_heard_and_reset(node, bench):
    node.nmt.state = "OPERATIONAL"
    heard, arrived = [], threading.Event()
    node.emcy.add_callback(lambda emergency: (heard.append(emergency), arrived.set()))
    bench.node.drive.fail(0x4310)
    node.network.sync.transmit()
    assert arrived.wait(3)
    assert (heard[0].code, heard[0].register & 0x01) == (0x4310, 0x01)
    mapped(node)
    node.nmt.state = "OPERATIONAL"
    node.setup_402_state_machine()
    node.network.sync.start(0.01)
    assert node.tpdo[1].wait_for_reception(3) is not None
    assert node.is_faulted()
    node.reset_from_fault()
    assert node.sdo[0x603F].raw == 0
    assert not node.sdo[0x6041].raw & 0x08
