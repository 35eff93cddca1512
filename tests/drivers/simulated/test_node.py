"""The simulated node as a CANopen slave: NMT, SDO, PDOs, heartbeat, EMCY and faults, frame by frame."""

import struct

import numpy as np
import pytest

from drivers.cia402 import Mode
from drivers.errors import DriveError
from drivers.simulated.settings import SimulatedDrivesSettings

CSP = Mode.CYCLIC_SYNCHRONOUS_POSITION


def ids(frames):
    return [int(can_id) for can_id in frames["can_id"]]


def answers(frames):
    """TPDO 1 of node 5 per SYNC: how many frames came after each SYNC."""
    counts = []
    for can_id in ids(frames):
        if can_id == 0x80:
            counts.append(0)
        elif can_id == 0x185:
            counts[-1] += 1
    return counts


def write(bench, index, subindex, kind, value):
    bench.drive.sdo.write(index, subindex, kind, value)


def nmt(bench, command, node=5):
    bench.receiver.send(0, bytes((command, node)))


def test_a_node_boots_up_when_the_rig_is_switched_on_and_after_a_reset(open_bench):
    bench = open_bench()
    nmt(bench, 129)
    nmt(bench, 130, node=0)
    nmt(bench, 129, node=6)
    frames = bench.receiver.read()
    assert ids(frames) == [0, 0x705, 0, 0x705, 0]
    assert set(frames[frames["can_id"] == 0x705]["data"][:, 0]) == {0}


def test_a_reset_forgets_what_was_written_communication_only_its_own_part(open_bench):
    bench = open_bench()
    write(bench, 0x1017, 0, "uint16", 500)
    write(bench, 0x607C, 0, "int32", 99)
    nmt(bench, 130)
    assert bench.drive.sdo.read(0x1017, 0, "uint16") == 0
    assert bench.drive.sdo.read(0x607C, 0, "int32") == 99
    nmt(bench, 129)
    assert bench.drive.sdo.read(0x607C, 0, "int32") == 0


def test_pdos_are_for_operational_and_sdo_is_not_for_stopped(open_bench):
    bench = open_bench()
    bench.bring_up()
    assert answers(bench.run(3)) == [1, 1, 1]
    nmt(bench, 128)
    assert answers(bench.run(3)) == [0, 0, 0]
    nmt(bench, 2)
    with pytest.raises(DriveError, match="no answer"):
        bench.drive.state()
    nmt(bench, 1)
    assert answers(bench.run(3)) == [1, 1, 1]


def test_heartbeats_carry_the_nmt_state_and_end_with_their_period(open_bench):
    bench = open_bench()
    watch = bench.drive.watch
    bench.drive.produce_heartbeat(0.01)
    for name, state in (("OPERATIONAL", 5), ("STOPPED", 4), ("PRE-OPERATIONAL", 127)):
        bench.drive.set_nmt_state(name)
        assert watch.nmt_state == state
    bench.drive.produce_heartbeat(0)
    heard = watch.last_heard
    assert not watch.wait_for(lambda: watch.last_heard != heard, 0.1)


@pytest.mark.parametrize(("transmission_type", "expected"), [(1, [1] * 6), (3, [0, 0, 1, 0, 0, 1])])
def test_synchronous_tpdos_come_every_so_many_syncs(open_bench, transmission_type, expected):
    bench = open_bench()
    bench.bring_up()
    nmt(bench, 128)
    write(bench, 0x1800, 1, "uint32", 0x80000185)
    write(bench, 0x1800, 2, "uint8", transmission_type)
    write(bench, 0x1800, 1, "uint32", 0x185)
    nmt(bench, 1)
    assert answers(bench.run(6)) == expected


def test_an_event_driven_tpdo_comes_when_its_data_changes(open_bench):
    """TPDO 1 as the EDS has it: the statusword, type 255."""
    bench = open_bench()
    nmt(bench, 1)
    bench.receiver.read()
    write(bench, 0x6040, 0, "uint16", 0x06)
    write(bench, 0x6040, 0, "uint16", 0x06)
    frames = bench.receiver.read()
    (status,) = frames[frames["can_id"] == 0x185]
    assert struct.unpack("<H", bytes(status["data"][:2]))[0] & 0x6F == 0x21


def test_a_synchronous_rpdo_takes_effect_at_the_next_sync_and_not_before(open_bench):
    bench = open_bench()
    bench.bring_up()
    stream = bench.streams[0]
    bench.receiver.send(stream.receive.can_id, stream.setpoint(0x0F, 777))
    assert bench.drive.sdo.read(0x607A, 0, "int32") == 0
    bench.run(1)
    assert bench.drive.sdo.read(0x607A, 0, "int32") == 777


def test_an_rpdo_that_is_too_short_is_answered_with_emcy(open_bench):
    bench = open_bench()
    bench.bring_up()
    bench.receiver.send(0x205, b"\x0f\x00\x01")
    assert bench.drive.watch.wait_for(lambda: bool(bench.drive.emergencies), 2.0)
    assert bench.drive.emergencies[0].code == 0x8210


@pytest.mark.parametrize(
    ("index", "subindex", "kind", "value", "words"),
    [
        (0x6041, 0, "uint16", 1, "0x06010002"),  # read only
        (0x5FFF, 0, "uint16", 1, "0x06020000"),  # not there
        (0x607D, 9, "int32", 1, "0x06090011"),  # no such subindex
        (0x6040, 0, "uint32", 1, "0x06070010"),  # wrong length
        (0x6060, 0, "int8", 1, "0x06090030"),  # profile position: not supported
        (0x1A00, 1, "uint32", 0x60650020, "0x06040041"),  # cannot be mapped
    ],
)
def test_sdo_requests_that_cannot_be_are_aborted_with_the_standard_s_code(
    open_bench, index, subindex, kind, value, words
):
    with pytest.raises(DriveError, match=words):
        write(open_bench(), index, subindex, kind, value)


def test_a_mapping_longer_than_a_frame_is_aborted(open_bench):
    bench = open_bench()
    write(bench, 0x1A00, 0, "uint8", 0)
    for position in (1, 2, 3):
        write(bench, 0x1A00, position, "uint32", 0x60640020)
    with pytest.raises(DriveError, match="0x06040042"):
        write(bench, 0x1A00, 0, "uint8", 3)


@pytest.mark.parametrize("mapping", [0x1600, 0x1A00])
def test_a_mapping_is_not_changed_while_its_pdo_is_in_use(open_bench, mapping):
    bench = open_bench()
    bench.bring_up()
    with pytest.raises(DriveError, match="0x08000022"):
        write(bench, mapping, 0, "uint8", 0)


def test_long_objects_are_read_in_segments(open_bench):
    assert open_bench().drive.sdo.read_bytes(0x1008, 0) == b"Simulated servo drive"


def test_planned_losses_are_lost_and_planned_delays_are_late_by_one_cycle(open_bench, axis):
    faults = {"lose_cycles": {2}, "late_cycles": {5, 6}}
    bench = open_bench(axis(faults=faults))
    bench.bring_up()
    frames = bench.run(10)
    assert answers(frames) == [1, 1, 0, 1, 1, 0, 1, 2, 1, 1]


def test_probabilities_of_losses_and_delays_are_kept(open_bench, axis):
    bench = open_bench(axis(faults={"lose_probability": 0.1, "late_probability": 0.1}), seed=3)
    bench.bring_up()
    counts = np.array(answers(bench.run(3000)))
    lost = 3000 - counts.sum()
    # 300 expected, standard deviation 16; one may still be on its way.
    assert 240 < lost < 360
    # Late, and followed by a cycle that is neither lost nor late: 219 expected, standard deviation 14.
    assert 170 < np.count_nonzero(counts == 2) < 270


def test_a_frozen_node_does_nothing_any_more(open_bench, axis):
    bench = open_bench(axis(faults={"freeze_at": 4}))
    bench.bring_up()
    assert answers(bench.run(8)) == [1, 1, 1, 1, 0, 0, 0, 0]
    heard = bench.drive.watch.last_heard
    assert not bench.drive.watch.wait_for(lambda: bench.drive.watch.last_heard != heard, 0.15)


def test_a_planned_emergency_comes_at_its_cycle(open_bench, axis):
    bench = open_bench(axis(faults={"emergency_at": 3, "emergency_code": 0x3210}))
    bench.bring_up()
    frames = bench.run(6)
    before = ids(frames)[: ids(frames).index(0x85)]
    assert before.count(0x80) == 4
    emergency = frames[frames["can_id"] == 0x85][0]
    assert bytes(emergency["data"][:3]) == b"\x10\x32\x05"  # generic, voltage


def test_a_glitch_of_the_encoder_shows_in_one_sample_only(open_bench, axis):
    bench = open_bench(axis(faults={"glitch_cycles": {5}, "glitch_counts": 5000}))
    bench.bring_up()
    position = bench.values(bench.run(12), "position")
    assert np.flatnonzero(np.abs(position) > 1000).tolist() == [6]
    assert position[6] == pytest.approx(5000, abs=2)


def test_a_saturated_drive_has_less_current_for_a_while(open_bench, axis):
    faults = {"saturate_from": 50, "saturate_to": 100, "saturate_factor": 0.1}
    bench = open_bench(axis(faults=faults, current_limit=2.0))
    bench.bring_up(Mode.CYCLIC_SYNCHRONOUS_TORQUE)
    command = bench.values(bench.run(150, lambda k: 1000), "command")
    assert set(command[5:50]) == {1000}
    assert set(command[53:100]) == {200}
    assert set(command[103:]) == {1000}


def test_a_heartbeat_that_is_planned_to_stop_stops(open_bench, axis):
    bench = open_bench(axis(faults={"heartbeat_stops_at": 2}))
    bench.bring_up()
    bench.run(5)
    heard = bench.drive.watch.last_heard
    assert not bench.drive.watch.wait_for(lambda: bench.drive.watch.last_heard != heard, 0.15)


def test_two_axes_with_the_same_node_id_are_refused(axis):
    with pytest.raises(ValueError, match="every axis needs a node id of its own"):
        SimulatedDrivesSettings(axes=(axis(node=3), axis(node=3)))


def test_drives_and_motors_must_match(open_bench, axis):
    from drivers.simulated.rig import SimulatedRig

    bench = open_bench()
    settings = SimulatedDrivesSettings(axes=(axis(node=1), axis(node=2)))
    with pytest.raises(ValueError, match="2 drives cannot move a mechanism with 1 motors"):
        SimulatedRig(settings, bench.bus, bench.flywheels)


def test_a_master_reads_the_ratings_of_the_drive_as_the_profile_scales_them(open_bench, axis):
    """CiA 402: currents in parts of a thousand, encoder counts by turns of the motor (0x608F)."""
    set_up = axis(
        counts_per_turn=4096, current_limit=1.5, rated_current=2.5, rated_torque=0.4, max_speed=100.0
    )
    sdo = open_bench(set_up).drive.sdo

    def value(index, subindex=0):
        return int.from_bytes(sdo.read_bytes(index, subindex), "little")

    assert (value(0x608F, 1), value(0x608F, 2)) == (4096, 1)
    assert value(0x6072) == value(0x6073) == 1500
    assert (value(0x6075), value(0x6076)) == (2500, 400)
    assert value(0x6080) == round(100.0 * 60 / (2 * np.pi))  # rpm


def test_a_drive_may_hold_other_values_and_objects_that_others_do_not_have(open_bench, axis):
    sdo = open_bench(axis(oddities={"holds": {"0x6502": 0x81, "0x2F42": 0x12345678}})).drive.sdo
    assert sdo.read(0x6502, 0, "uint32") == 0x81
    assert sdo.read_bytes(0x2F42, 0) == (0x12345678).to_bytes(4, "little")
    with pytest.raises(DriveError, match="read"):
        sdo.write(0x2F42, 0, "uint32", 1)
