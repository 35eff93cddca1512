"""The drive against a simulated one: each step verified, each failure with its reason."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from drivers import canopen_network
from drivers.canopen_network import NodeWatch
from drivers.cia402 import Mode, State
from drivers.drive import Drive
from drivers.errors import DriveError
from drivers.process_data import TORQUE_OFFSET
from drivers.profile import GENERIC
from drivers.simulated.oddities import OdditySettings

CSP = Mode.CYCLIC_SYNCHRONOUS_POSITION


def test_identity_is_that_of_the_node(open_bench):
    identity = open_bench().drive.identity()
    assert (identity.vendor, identity.product, identity.profile) == (0, 0x402, 402)


def test_a_drive_of_another_vendor_than_the_profile_s_is_refused(open_bench):
    bench = open_bench()
    foreign = GENERIC.model_copy(update={"vendor_id": 0x9A})
    with pytest.raises(DriveError, match=r"0x1018:01\): expected vendor 0x0000009A; 0x00000000 came"):
        Drive(bench.network, 5, foreign).identity()


def test_the_rated_torque_is_read_in_newton_metres(open_bench, axis):
    bench = open_bench(axis(rated_torque=2.22))
    assert bench.drive.rated_value() == pytest.approx(2.22)


def test_a_rated_torque_of_zero_is_not_believed(open_bench):
    bench = open_bench()
    bench.node.set_data(0x6076, 0, bytes(4))
    with pytest.raises(DriveError, match="enter the motor's rated value in the drive"):
        bench.drive.rated_value()


def test_a_node_that_is_not_there_is_named_with_the_time_out(open_bench):
    bench = open_bench()
    with pytest.raises(DriveError, match=r"node 9: .* no answer within 0\.3 s, asked 3 times") as raised:
        Drive(bench.network, 9).identity()
    assert (raised.value.node, raised.value.index) == (9, 0x1018)


def test_bring_up_ends_in_operation_enabled_in_the_mode_asked_for(open_bench):
    bench = open_bench()
    bench.bring_up(CSP)
    assert bench.drive.state() is State.OPERATION_ENABLED
    assert bench.drive.mode() == CSP
    bench.drive.disable()
    assert bench.drive.state() is State.SWITCH_ON_DISABLED


@pytest.mark.parametrize("mode", list(Mode))
def test_every_mode_is_shown_by_the_drive_after_switching(open_bench, mode):
    bench = open_bench()
    bench.drive.set_mode(mode)
    assert bench.node.drive.image[3] == mode


def test_a_mode_switch_that_the_drive_ignores_is_an_error(open_bench):
    bench = open_bench()
    bench.node.faults.keep_mode = True
    with pytest.raises(DriveError, match=r"0x6061:00\): expected mode 8 within 0\.1 s; .* stays in mode 0"):
        bench.drive.set_mode(CSP)


def test_a_mode_that_the_drive_does_not_support_is_refused_before_writing(open_bench):
    bench = open_bench()
    bench.node.set_data(0x6502, 0, (1 << 9).to_bytes(4, "little"))
    with pytest.raises(DriveError, match="does not support this mode"):
        bench.drive.set_mode(CSP)
    bench.drive.set_mode(Mode.CYCLIC_SYNCHRONOUS_TORQUE)


def test_a_drive_in_fault_is_not_enabled_and_says_why(open_bench):
    bench = open_bench()
    bench.node.drive.fail(0x4310)
    with pytest.raises(DriveError, match="in FAULT: 0x4310 motor or transmission too hot") as raised:
        bench.drive.enable()
    assert "error register: generic error, temperature" in str(raised.value)
    bench.drive.reset_fault()
    bench.drive.enable()
    assert bench.drive.state() is State.OPERATION_ENABLED


def test_a_fault_that_stays_is_an_error_of_the_reset(open_bench, monkeypatch):
    bench = open_bench()
    bench.node.drive.fail(0x3220)
    monkeypatch.setattr(bench.node.drive.machine, "take_controlword", lambda word: None)
    with pytest.raises(DriveError, match=r"fault reset .*in FAULT .*0x3220 DC link under-voltage"):
        bench.drive.reset_fault()


def test_resetting_without_a_fault_does_no_harm(open_bench):
    bench = open_bench()
    bench.bring_up()
    bench.drive.reset_fault()
    assert bench.drive.state() is State.OPERATION_ENABLED


def test_a_drive_that_stays_behind_is_named_with_state_and_reason(open_bench, monkeypatch):
    bench = open_bench()
    monkeypatch.setattr(bench.node.drive.machine, "take_controlword", lambda word: None)
    with pytest.raises(DriveError) as raised:
        bench.drive.enable()
    words = str(raised.value)
    assert "expected READY TO SWITCH ON within 0.2 s" in words
    assert "the drive is in SWITCH ON DISABLED" in words
    assert raised.value.index == 0x6041


def test_a_drive_without_voltage_says_so(open_bench, monkeypatch):
    bench = open_bench()
    monkeypatch.setattr(bench.node.drive.machine, "take_controlword", lambda word: None)
    monkeypatch.setattr(bench.node.drive, "update_statusword", lambda: None)
    bench.node.drive.image[1] = 0x0040
    with pytest.raises(DriveError, match=r"no voltage at the power stage .* not take commands from the bus"):
        bench.drive.enable()


def test_a_frozen_drive_is_a_time_out_not_a_hang(open_bench):
    bench = open_bench()
    bench.bring_up()
    bench.node.faults.frozen = True
    with pytest.raises(DriveError, match=r"no answer within 0\.2 s, asked 2 times"):
        bench.drive.state()


def test_an_nmt_command_without_a_heartbeat_that_confirms_it_is_an_error(open_bench):
    bench = open_bench()
    bench.drive.produce_heartbeat(0.02)
    bench.drive.set_nmt_state("OPERATIONAL")
    bench.node.faults.heartbeat_stopped = True
    bench.drive.timeouts = replace(bench.drive.timeouts, nmt=0.1)
    with pytest.raises(DriveError, match="NMT command to STOPPED: expected a heartbeat with STOPPED"):
        bench.drive.set_nmt_state("STOPPED")


def test_an_nmt_reset_is_confirmed_by_the_boot_up(open_bench):
    bench = open_bench()
    bench.bring_up()
    bench.drive.reset_node()
    assert bench.drive.watch.boot_ups == 1
    assert bench.drive.state() is State.SWITCH_ON_DISABLED
    bench.node.faults.frozen = True
    bench.drive.timeouts = replace(bench.drive.timeouts, boot=0.1)
    with pytest.raises(DriveError, match="expected boot-up within"):
        bench.drive.reset_node()


def test_silence_tells_how_long_the_heartbeat_is_missing(monkeypatch):
    clock = SimpleNamespace(monotonic=lambda: 100.0)
    monkeypatch.setattr(canopen_network, "time", clock)
    watch = NodeWatch(5)
    assert watch.silence is None
    watch.on_heartbeat(0x705, bytearray(b"\x05"), 0.0)
    clock.monotonic = lambda: 100.25
    assert watch.silence == 0.25
    assert watch.nmt_state == 5


def test_the_stream_is_what_the_drive_confirmed(open_bench):
    bench = open_bench()
    stream = bench.drive.map_stream(CSP, temperature=False)
    assert stream.transmit_ids == (0x185,)
    (pdo,) = stream.transmit
    assert [(entry.name, entry.index, entry.byte_offset) for entry in pdo.entries] == [
        ("position", 0x6064, 0),
        ("command", 0x6074, 4),
        ("statusword", 0x6041, 6),
    ]
    assert stream.receive.can_id == 0x205
    assert stream.setpoint(0x0F, -2) == b"\x0f\x00\xfe\xff\xff\xff"
    with pytest.raises(KeyError):
        stream.find("temperature")


def test_a_torque_offset_is_mapped_beside_the_target_where_it_is_asked_for(open_bench):
    bench = open_bench()
    stream = bench.drive.map_stream(CSP, torque=TORQUE_OFFSET)
    assert [(entry.index, entry.byte_offset) for entry in stream.receive.entries] == [
        (0x6040, 0),
        (0x607A, 2),
        (0x60B2, 6),
    ]
    assert stream.packed_with_torque(0x0F, -2, -3) == b"\x0f\x00\xfe\xff\xff\xff\xfd\xff"
    assert stream.setpoint(0x0F, -2) == b"\x0f\x00\xfe\xff\xff\xff\x00\x00"
    assert bench.drive.map_stream(CSP).torque_entry is None


def test_a_drive_that_takes_no_torque_offset_is_refused_with_what_would_be_needed(open_bench, axis):
    bench = open_bench(axis(oddities=OdditySettings(fixed_pdos=True)))
    with pytest.raises(
        DriveError, match=r"0x60B2 .*axes\[\]\.feedforward: cyclic-torque of the rig file says so"
    ):
        bench.drive.map_stream(CSP, torque=TORQUE_OFFSET)
    assert bench.drive.map_stream(CSP).torque_entry is None


def test_a_torque_offset_that_a_dead_session_left_is_cleared(open_bench):
    bench = open_bench()
    bench.drive.sdo.write(0x60B2, 0, "int16", 250, "the session before")
    bench.drive.clear_torque_offset()
    assert bench.drive.sdo.read(0x60B2, 0, "int16", "looking") == 0


def test_a_mapping_that_reads_back_differently_is_an_error(open_bench, monkeypatch):
    bench = open_bench()
    honest = bench.node.get_data

    def forgetful(index, subindex, check_readable=False):
        if (index, subindex) == (0x1A00, 2):
            return (0x60770010).to_bytes(4, "little")
        return honest(index, subindex, check_readable)

    monkeypatch.setattr(bench.node, "get_data", forgetful)
    with pytest.raises(DriveError, match=r"mapping TPDO 1, entry command .*expected 0x60740010; 0x60770010"):
        bench.drive.map_stream(CSP)


def test_a_mapping_that_the_drive_refuses_gives_its_abort_code_in_words(open_bench):
    bench = open_bench()
    unmappable = GENERIC.position.model_copy(update={"index": 0x6065})
    drive = Drive(bench.network, 5, GENERIC.model_copy(update={"position": unmappable}))
    with pytest.raises(DriveError, match=r"the drive refused: .*mapped.* 0x06040041"):
        drive.map_stream(CSP)


@pytest.mark.parametrize(
    ("period", "expected"), [(0.001, (1, -3)), (0.002, (2, -3)), (0.0005, (5, -4)), (0.00125, (125, -5))]
)
def test_the_cycle_is_written_in_the_drive_s_own_way(open_bench, period, expected):
    bench = open_bench()
    bench.drive.set_cycle(period)
    node = bench.node
    assert node.get_data(0x60C2, 1)[0] == expected[0]
    assert int.from_bytes(node.get_data(0x60C2, 2), "little", signed=True) == expected[1]
    assert node.period == pytest.approx(period)


def test_a_cycle_that_cannot_be_written_is_refused(open_bench):
    with pytest.raises(ValueError, match="cannot be written as 1 to 255 units"):
        open_bench().drive.set_cycle(0.0012345)


def test_a_value_that_does_not_fit_its_object_is_refused_before_it_is_sent(open_bench):
    with pytest.raises(ValueError, match="70000 does not fit object 0x1017:00"):
        open_bench().drive.sdo.write(0x1017, 0, "uint16", 70000)


def test_emergencies_are_kept_in_words(open_bench):
    bench = open_bench()
    heard = []
    bench.drive.watch.on_emergency = heard.append
    bench.drive.sdo.write(0x2010, 1, "int32", 0x7305)
    assert bench.drive.watch.wait_for(lambda: bool(heard), 5.0)
    assert str(heard[0]) == "node 5: 0x7305 incremental encoder 1 (generic error)"
    bench.drive.reset_fault()
    assert bench.drive.watch.wait_for(lambda: len(heard) == 2, 5.0)
    assert heard[1].is_reset
    assert bench.drive.emergencies == tuple(heard)


@pytest.mark.parametrize("node", [0, 128])
def test_a_node_id_that_canopen_does_not_have_is_refused(open_bench, node):
    with pytest.raises(ValueError, match="between 1 and 127"):
        Drive(open_bench().network, node)
