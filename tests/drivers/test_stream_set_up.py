"""A drive whose objects are odd is set up all the same, which is said, or refused in one line."""

from dataclasses import replace

import pytest

from drivers.cia402 import Mode, State
from drivers.drive import Drive, Timeouts
from drivers.errors import DriveError
from drivers.simulated.oddities import OdditySettings

MAPPINGS = tuple(f"0x{first + number:04X}" for first in (0x1600, 0x1A00) for number in range(4))
CARRIES_WHAT_IS_NEEDED = {
    f"0x{index:04X}:{subindex:02X}": value
    for index, entries in (
        (0x1A00, (0x60410010, 0x60640020)),
        (0x1A01, (0x60740010, 0x60770010)),
        (0x1600, (0x60400010, 0x60600008, 0x607A0020)),
    )
    for subindex, value in (*enumerate(entries, 1), (0, len(entries)))
} | {"0x1800:01": 0x1C5, "0x1801:01": 0x285, "0x1400:01": 0x205, "0x1800:02": 1, "0x1801:02": 1}
MODE = Mode.CYCLIC_SYNCHRONOUS_POSITION
FIXED_COB_IDS = tuple(f"0x{first + number:04X}:01" for first in (0x1400, 0x1800) for number in range(4))


def set_up(bench):
    """What a session does to a drive before it has power; all that was said of it."""
    drive = Drive(bench.network, 5, timeouts=Timeouts(sdo=0.2, retries=1, nmt=0.5, mode=0.1))
    drive.produce_heartbeat(0.05)
    drive.set_nmt_state("PRE-OPERATIONAL")
    assert drive.identity().profile == 402
    lacks = drive.oddities()
    drive.map_stream(MODE)
    drive.set_mode(MODE)
    drive.set_cycle(0.002)
    drive.watch_master(127, 0.5)
    drive.set_nmt_state("OPERATIONAL")
    return "; ".join([*lacks, *drive.set_up_remarks])


@pytest.mark.parametrize(
    ("oddities", "said"),
    [
        ({"read_only": ("0x60C2:02",)}, ""),
        ({"read_only": ("0x60C2:02",), "holds": {"0x60C2:02": -4}}, ""),
        ({"read_only": ("0x1006",)}, "keeps its communication cycle (0x1006)"),
        ({"read_only": ("0x1400:02",)}, "takes setpoints when they come, not at SYNC"),
        ({"read_only": ("0x1016",)}, "cannot be told to watch us (0x1016:01 can only be read)"),
        ({"read_only": ("0x1017",)}, "it is asked by remote frames (node guarding)"),
        ({"holds": {"0x6502": 0}}, ""),
        ({"holds": {"0x607E": 0x80}}, "counts the other way (polarity 0x607E, bit 7)"),
        ({"holds": {"0x6091:01": 5, "0x6091:02": 1}}, "has a gear ratio (0x6091) of 5:1"),
        ({"missing": ("0x1018",)}, ""),
        ({"missing": ("0x6061",)}, "has no mode display (0x6061)"),
        (
            {"read_only": FIXED_COB_IDS},
            "its COB-IDs can only be read: they are used as they stand (0x185, 0x205)",
        ),
        ({"read_only": FIXED_COB_IDS, "holds": {"0x1803:01": 0x485}}, "; TPDO 4 cannot be switched off"),
        ({"missing": ("0x1801", "0x1802", "0x1803")}, "has 1 TPDOs"),
        (
            {"read_only": MAPPINGS, "holds": CARRIES_WHAT_IS_NEEDED},
            "its TPDOs are used unchanged (0x1C5: [0x60410010, 0x60640020], 0x285: [0x60740010, 0x60770010]); its PDO mapping"
            " cannot be changed; its RPDOs are used unchanged (0x205: [",
        ),
        (
            {"read_only": MAPPINGS, "holds": CARRIES_WHAT_IS_NEEDED | {"0x1400:02": 255}},
            "its RPDOs are used unchanged",
        ),
        (
            {"read_only": ("0x1A00", "0x1A01"), "holds": CARRIES_WHAT_IS_NEEDED},
            "its TPDOs are used unchanged",
        ),
        (
            {"read_only": ("0x1600", "0x1400:02"), "holds": CARRIES_WHAT_IS_NEEDED | {"0x1400:02": 255}},
            "takes setpoints when they come, not at SYNC",
        ),
    ],
)
def test_it_is_set_up_and_what_is_otherwise_is_said(open_bench, axis, oddities, said):
    assert said in set_up(open_bench(axis(oddities=OdditySettings(**oddities))))


def test_a_drive_that_boots_late_is_waited_for_and_named_where_it_takes_too_long(open_bench, axis):
    bench = open_bench(axis(oddities=OdditySettings(boots_after=0.3)))
    bench.bring_up()
    bench.drive.reset_node()
    assert bench.drive.watch.boot_ups == 1
    assert bench.drive.state() is State.SWITCH_ON_DISABLED
    slower = open_bench(axis(oddities=OdditySettings(boots_after=600.0)))
    slower.bring_up()
    slower.drive.timeouts = replace(slower.drive.timeouts, boot=0.05)
    with pytest.raises(DriveError, match=r"NMT reset: expected boot-up within 0\.05 s; none came"):
        slower.drive.reset_node()
    assert not slower.node.drive.machine.enabled, "it has no power while it boots"


@pytest.mark.parametrize(
    ("oddities", "words"),
    [
        ({"missing": ("0x60C2", "0x1006")}, r"the drive has neither"),
        ({"holds": {"0x6502": 1}}, r"0x00000001 came: the drive does not support"),
        ({"read_only": ("0x1600",)}, r"controlword and target .* together in a RPDO"),
        ({"read_only": ("0x1A00",)}, r"position \(0x6064:00\) in a TPDO that is on"),
        ({"missing": ("0x1800", "0x1801", "0x1802", "0x1803")}, r"expected 1 TPDOs; it has 0"),
    ],
)
def test_what_cannot_be_done_without_is_named_in_one_line(open_bench, axis, oddities, words):
    bench = open_bench(axis(oddities=OdditySettings(**oddities)))
    with pytest.raises(DriveError, match=words) as raised:
        set_up(bench)
    assert "\n" not in str(raised.value)


def test_what_was_mapped_is_what_is_on_where_the_mapping_alone_is_fixed(open_bench, axis):
    """Set-up switches a PDO off before it writes its mapping: one that refuses that is switched on again as it was."""
    oddities = OdditySettings(read_only=MAPPINGS, holds=CARRIES_WHAT_IS_NEEDED)
    bench = open_bench(axis(oddities=oddities))
    stream = bench.drive.map_stream(MODE)
    assert stream.transmit_ids == (0x1C5, 0x285)
    assert [bench.drive.sdo.read(index, 1, "uint32") for index in (0x1800, 0x1801)] == [0x1C5, 0x285]
    assert stream.receive.can_id == bench.drive.sdo.read(0x1400, 1, "uint32") == 0x205
    assert stream.setpoint(0x0F, 7) == bytes((0x0F, 0, MODE.value, 7, 0, 0, 0))
