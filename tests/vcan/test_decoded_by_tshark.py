"""What we and our drive put on the bus, read by somebody else: Wireshark's CANopen dissector."""

import shutil
import subprocess
import threading

import pytest

from daq.raw_log import RawLog
from drivers.canopen_network import CanopenNetwork
from drivers.cia402 import Command, Mode
from drivers.drive import Drive
from drivers.profile import load_profile
from drivers.receive_socketcan import SocketCanReceiver
from drivers.sync_producer import RealTime, SyncProducer

NODE = 3


def tshark(log, *arguments):
    result = subprocess.run(
        ["tshark", "-r", str(log), "-d", "can.subdissector,canopen", *arguments],
        capture_output=True,
        text=True,
        check=True,
    )
    return result.stdout.splitlines()


@pytest.fixture
def need_tshark():
    if shutil.which("tshark") is None:
        pytest.skip("tshark is not installed (Debian package tshark)")


@pytest.fixture
def session_log(need_tshark, fake_drive, bus, tmp_path):
    """A whole session, bring-up to fault reset, as the raw log of a recording keeps it."""
    path = tmp_path / "session.log"
    listener = SocketCanReceiver("vcan0")
    listener.open()
    log = RawLog(path, "vcan0")
    ended = threading.Event()

    def record():
        while not ended.wait(0.01):
            log.append(listener.read())
        log.append(listener.read())

    recorder = threading.Thread(target=record)
    recorder.start()
    with CanopenNetwork(bus) as network:
        drive = Drive(network, NODE, load_profile("simulated"))
        drive.reset_node()
        drive.identity()
        drive.produce_heartbeat(0.05)
        stream = drive.map_stream(Mode.CYCLIC_SYNCHRONOUS_POSITION, temperature=True)
        drive.set_cycle(0.004)
        drive.set_nmt_state("OPERATIONAL")
        drive.set_mode(Mode.CYCLIC_SYNCHRONOUS_POSITION)
        drive.enable()
        start = drive.position()
        receiver = SocketCanReceiver("vcan0")
        receiver.open()

        def on_cycle(cycle):
            data = stream.setpoint(Command.ENABLE_OPERATION, start + 20 * cycle)
            receiver.send(stream.receive.can_id, data)

        SyncProducer(receiver.send, 0.004, RealTime(), on_cycle).run(100)
        receiver.close()
        drive.sdo.write(0x2010, 1, "int32", 0x8611)
        drive.sdo.read_bytes(0x1008, 0)  # a segmented transfer
        drive.reset_node()
    ended.set()
    recorder.join()
    listener.close()
    log.close()
    return path


def test_no_frame_of_a_session_is_malformed_and_all_kinds_are_recognised(session_log):
    assert tshark(session_log, "-Y", "_ws.malformed || _ws.expert") == []
    kinds = tshark(session_log, "-T", "fields", "-e", "_ws.col.Info")
    for kind, at_least in {
        "NMT: Reset node [0x3]": 2,
        "NMT: Start remote node [0x3]": 1,
        "NMT Error Control: Boot-up [0x3]": 2,
        "NMT Error Control: Operational [0x3]": 3,
        "NMT Error Control: Pre-operational [0x3]": 1,
        "SYNC": 100,
        "PDO1 (tx)": 100,
        "PDO2 (tx)": 100,
        "PDO1 (rx)": 100,
        "EMCY": 1,
        "Default-SDO (rx): Initiate download request": 20,
        "Default-SDO (tx): Initiate download response": 20,
        "Default-SDO (rx): Upload segment request": 1,
        "Default-SDO (tx): Upload segment response": 1,
    }.items():
        assert sum(info.strip() == kind for info in kinds) >= at_least, kind


def test_a_malformed_frame_would_be_found(need_tshark, tmp_path):
    log = tmp_path / "malformed.log"
    log.write_text("(1700000000.000000) vcan0 603#40\n")
    assert len(tshark(log, "-Y", "_ws.malformed")) == 1
