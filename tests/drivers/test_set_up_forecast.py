"""What set-up will do to a drive is said before anything is written: by what it holds, and by its EDS where it has one."""

import re
from importlib.resources import files

import pytest

from drivers.cia402 import Mode
from drivers.drive import Drive
from drivers.errors import DriveError
from drivers.profile import GENERIC, load_profile
from drivers.simulated.oddities import OdditySettings
from tests.drivers.test_stream_set_up import CARRIES_WHAT_IS_NEEDED, FIXED_COB_IDS, MAPPINGS

OTHER_IDS = {"0x1800:01": 0x1A5, "0x1400:01": 0x2A5}
WITHOUT_EDS, WITH_EDS = "where it refuses {}, ", "by mine.eds, {} can only be read: "


def stated_by(folder, read_only):
    """A drive's own EDS in which these sections can only be read."""
    text = (files("config") / "drives" / "simulated.eds").read_text(encoding="utf-8")
    for section in read_only:
        text, changed = re.subn(rf"(?is)(\[{section}\].*?AccessType=)rw", r"\1const", text, count=1)
        assert changed
    path = folder / "mine.eds"
    path.write_text(text, encoding="utf-8")
    return load_profile(path)


def said(bench, profile, cycle=0.002):
    """In advance, with a drive to which nothing may be written."""
    drive = Drive(bench.network, 5, profile)

    def refuse(*what, **_more):
        raise AssertionError(f"written: {what}")

    drive.sdo.write = refuse
    return drive.set_up_in_advance(Mode.CYCLIC_SYNCHRONOUS_POSITION, cycle)


CASES = [
    (
        {"read_only": FIXED_COB_IDS, "holds": OTHER_IDS},
        ("1800sub1", "1400sub1"),
        "0x1800:01 and 0x1400:01",
        "it goes on with 0x1A5 and 0x2A5",
    ),
    (
        {"read_only": MAPPINGS, "holds": CARRIES_WHAT_IS_NEEDED},
        ("1A00sub0", "1600sub0"),
        "0x1A00:00",
        "it is driven by its PDOs as they stand: TPDO 1 (0x1C5: statusword, position) and TPDO 2 (0x285: command, 0x6077)",
    ),
    (
        {"read_only": MAPPINGS, "holds": CARRIES_WHAT_IS_NEEDED},
        ("1A00sub1", "1600sub1"),
        "0x1600:{}",
        "it is driven by its PDOs as they stand: RPDO 1 (0x205: controlword, 0x6060, target)",
    ),
    (
        {"read_only": MAPPINGS},
        ("1A00sub0", "1600sub0"),
        "0x1A00:00",
        "the session is refused, for it has no position (0x6064:00) in a TPDO that is on; map it with the maker's tool",
    ),
    (
        {"fixed_interpolation": 5},
        ("60C2sub1",),
        "0x60C2:01",
        "the session is refused; give the rig the cycle 0.005 s",
    ),
    ({"read_only": ("0x1016",)}, ("1016sub1",), "0x1016:01", "it may not notice when we are gone"),
    (
        {"read_only": ("0x1800:02",)},
        ("1800sub2",),
        "0x1800:02",
        "it does not go with SYNC, and the session is refused; set transmission type 1 with the maker's tool",
    ),
    (
        {"holds": {"0x1800:01": 0x80000185}, "read_only": FIXED_COB_IDS},
        ("1800sub1",),
        "0x1800:01",
        "TPDO 1 stays off, and the session is refused; switch it on with the maker's tool",
    ),
    (
        {"holds": {"0x1803:01": 0x485}, "read_only": FIXED_COB_IDS},
        ("1803sub1",),
        "0x1803:01",
        "what cannot be switched off stays on beside them",
    ),
]


@pytest.mark.parametrize(("oddities", "read_only", "objects", "outcome"), CASES)
def test_what_comes_of_a_refusal_is_said_with_an_eds_and_without(
    open_bench, axis, tmp_path, oddities, read_only, objects, outcome
):
    bench = open_bench(axis(oddities=OdditySettings(**oddities)))
    without = "; ".join(said(bench, GENERIC))
    assert WITHOUT_EDS.format(objects.format("00")) + outcome in without
    with_eds = "; ".join(said(bench, stated_by(tmp_path, read_only)))
    assert WITH_EDS.format(objects.format("01")) + outcome in with_eds
    assert "where it refuses" not in with_eds


def test_an_eds_by_which_all_can_be_written_ends_the_doubt(open_bench, axis, tmp_path):
    bench = open_bench(axis(oddities=OdditySettings(holds=OTHER_IDS)))
    assert said(bench, stated_by(tmp_path, ())) == [
        "set-up is to write TPDO 1 (COB-ID 0x1A5 to 0x185, mapping, transmission type 255 to 1) and RPDO 1 (COB-ID 0x2A5 to"
        " 0x205, mapping, transmission type 255 to 1); by mine.eds, all of it can be written",
        "set-up is to write its interpolation time (0x60C2), 0.001 s to 0.002 s",
    ]


def test_of_what_an_eds_does_not_list_it_is_said_what_comes_of_a_refusal(open_bench, axis, tmp_path):
    bench = open_bench(axis(oddities=OdditySettings(holds=OTHER_IDS)))
    profile = stated_by(tmp_path, ("1800sub1",))
    eds = tmp_path / "mine.eds"
    eds.write_text(eds.read_text(encoding="utf-8").replace("[1400sub1]", "[5400sub1]"), encoding="utf-8")
    sentences = said(bench, profile)
    assert (
        "by mine.eds, 0x1800:01 can only be read; where it refuses 0x1400:01, too, it goes on with 0x1A5 and 0x2A5"
        in sentences
    )
    assert not any("all of it can be written" in each for each in sentences)


def test_what_is_as_needed_already_is_not_written_which_is_said(open_bench, axis):
    bench = open_bench(axis())
    bench.drive.map_stream(Mode.CYCLIC_SYNCHRONOUS_POSITION)
    bench.drive.set_cycle(0.002)
    sentences = said(bench, GENERIC)
    assert "has TPDO 1 (0x185) and RPDO 1 (0x205) as needed already: nothing is written there" in sentences
    assert (
        "its interpolation time (0x60C2) is the rig's cycle, 0.002 s, already: nothing is written there"
        in sentences
    )


def test_a_communication_cycle_that_can_only_be_read_is_said_to_stay(open_bench, axis, tmp_path):
    sentences = "; ".join(said(open_bench(axis()), stated_by(tmp_path, ("1006",))))
    assert "by mine.eds, 0x1006:00 can only be read: it keeps it, and has the cycle by 0x60C2" in sentences


def test_a_drive_without_enough_pdos_is_refused_in_advance(open_bench, axis):
    bench = open_bench(axis(oddities=OdditySettings(missing=("0x1800", "0x1801", "0x1802", "0x1803"))))
    with pytest.raises(DriveError, match="expected 1 TPDOs; it has 0"):
        said(bench, GENERIC)
