"""EDS and DCF files as they come: read for what has to do with driving, the rest passed over and said once."""

import os
import random
import re

import pytest

from drivers.cia402 import Mode
from drivers.drive import Drive
from drivers.eds import read_eds
from drivers.errors import DriverError
from drivers.object_dictionary import load_object_dictionary, passed_over
from drivers.profile import load_profile
from drivers.profile_against_dictionary import mismatches

FILES = int(os.environ.get("COULOMB_FUZZED_FILES", "150"))
"""Damaged files."""

WHOLE = """[FileInfo]
FileName=drive.eds
[DeviceInfo]
VendorName=Somebody
VendorNumber=0x9A
NrOfRXPDO=2
NrOfTXPDO=4
[Comments]
Lines=1
Line1=hello
[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00020192
PDOMapping=0
[1018]
ParameterName=Identity
ObjectType=0x9
SubNumber=2
[1018sub0]
ParameterName=entries
DataType=0x5
AccessType=ro
[1018sub1]
ParameterName=Vendor
DataType=0x7
AccessType=ro
[1800]
ParameterName=TPDO
ObjectType=9
SubNumber=2
[1800sub1]
ParameterName=COB-ID
DataType=0x7
AccessType=rw
DefaultValue=$NODEID+0x180
[6064]
ParameterName=Position actual value
DataType=0x0004
AccessType=ro
PDOMapping=1
LowLimit=0x80000000
[6074]
ParameterName=Torque demand
DataType=0x0003
AccessType=ro
PDOMapping=1
"""


def read(tmp_path, text, encoding="utf-8", name="drive.eds"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return read_eds(path, 5)


def essentials(dictionary):
    """What driving needs of the file above."""
    position = dictionary.get_variable(0x6064)
    return (
        position.data_type,
        position.pdo_mappable,
        position.min,
        dictionary.get_variable(0x1000).default,
        dictionary[0x1018][1].access_type,
        dictionary[0x1800][1].default,
    )


EXPECTED = (4, True, -(1 << 31), 0x00020192, "ro", 0x185)


def test_a_file_by_the_standard_has_nothing_to_be_said(tmp_path):
    found = read(tmp_path, WHOLE)
    assert essentials(found.dictionary) == EXPECTED
    assert found.passed_over == []
    assert found.dictionary.device_information.vendor_number == 0x9A


@pytest.mark.parametrize(
    ("change", "encoding", "said"),
    [
        (lambda text: text, "utf-8-sig", "byte order mark"),
        (lambda text: text, "utf-16", "byte order mark"),
        (lambda text: text.replace("Somebody", "Müller"), "cp1252", "not UTF-8"),
        (lambda text: text.replace("Lines=1", "Lines=3"), "utf-8", "comments"),
        (lambda text: text.replace("Lines=1\n", ""), "utf-8", "comments"),
        (lambda text: text + "\n[6064]\nParameterName=Again\nDataType=0x3\n", "utf-8", "occur twice"),
        (lambda text: text.replace("AccessType=ro", "AccessType=ro\nAccessType=wo"), "utf-8", ""),
        (lambda text: text.replace("VendorNumber=0x9A", "VendorNumber="), "utf-8", "VendorNumber"),
        (lambda text: text.replace("VendorNumber=0x9A", "VendorNumber=none"), "utf-8", "VendorNumber 'none'"),
        (lambda text: text.replace("VendorNumber=0x9A", "VendorNumber=001"), "utf-8", ""),
        (lambda text: text.replace("DataType=0x0004", "DataType=INTEGER32"), "utf-8", ""),
        (lambda text: text.replace("ObjectType=0x9", "ObjectType=RECORD"), "utf-8", ""),
        (lambda text: text, "utf-16-le", "without a byte order mark"),
        (lambda text: text, "utf-16-be", "without a byte order mark"),
        (lambda text: text.replace("PDOMapping=1", "PDOMapping=optional"), "utf-8", ""),
        (lambda text: text.replace("AccessType=ro", 'AccessType="RO"'), "utf-8", ""),
        (lambda text: text.replace("DataType=0x0004", "DataType=DINT"), "utf-8", ""),
        (lambda text: text.replace("DataType=0x0004", "DataType=Integer 32 // signed"), "utf-8", ""),
        (lambda text: text.replace("DataType=0x0007", "DataType=0x0007 # UNSIGNED32"), "utf-8", ""),
        (lambda text: text.replace("=", ": "), "utf-8", ""),
        (lambda text: text.replace("[6064]", "[6064h]").replace("sub1]", ".1]"), "utf-8", ""),
        (lambda text: text.replace("PDOMapping=1", "PDOMapping=TRUE"), "utf-8", ""),
        (lambda text: text.replace("=", " = ").replace("\n", "\r\n"), "utf-8", ""),
        (
            lambda text: text.replace("[1018sub1]", "[1018Sub1]").replace("[1800sub1]", "[1800SUB1]"),
            "utf-8",
            "",
        ),
        (lambda text: "a line by a tool\n" + text, "utf-8", "neither a section nor a field"),
        (lambda text: text + "\n[2000]\nParameterName=Odd\nDataType=what\n", "utf-8", "2000"),
    ],
)
def test_what_has_nothing_to_do_with_driving_is_passed_over_and_said(tmp_path, change, encoding, said):
    found = read(tmp_path, change(WHOLE), encoding)
    assert essentials(found.dictionary) == EXPECTED
    assert said in "; ".join(found.passed_over)
    assert bool(found.passed_over) == bool(said)
    assert len(set(found.passed_over)) == len(found.passed_over)


def test_a_file_that_is_no_eds_leaves_the_profile_to_say_what_is_driven(tmp_path):
    path = tmp_path / "drive.eds"
    path.write_bytes(b"\x00\x01 not an EDS")
    with pytest.raises(DriverError, match="holds no object"):
        load_object_dictionary(path, 5)
    (remark,) = passed_over(path, 5)
    assert "the profile alone says" in remark


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text, None),
        (
            lambda text: text.replace("DataType=0x0004", "DataType=0x0003"),
            "position 0x6064:00 .* int32, but int16",
        ),
        (
            lambda text: text.replace("PDOMapping=1", "PDOMapping=0"),
            None,
        ),  # nothing may be: such a file says nothing
        (lambda text: text.replace("PDOMapping=1", "PDOMapping=0", 1), "may not be mapped"),
        (lambda text: text.replace("PDOMapping=1\n", "", 1), None),
        (lambda text: text.replace("PDOMapping=1\n", "PDOMapping=\n", 1), None),
        (
            lambda text: text.replace("DataType=0x0003\nAccessType=ro", "DataType=0x0003\nAccessType=wo"),
            "write-only",
        ),
    ],
)
def test_a_profile_that_contradicts_its_eds_is_named(tmp_path, change, said):
    (tmp_path / "mine.EDS").write_text(change(WHOLE))
    profile = load_profile(str(tmp_path / "mine.EDS"))
    found = mismatches(profile, 5)
    if said is None:
        assert found == ()
    else:
        assert re.search(said, found[0])


def test_a_file_with_one_half_of_its_pdos_is_no_obstacle(tmp_path, open_bench):
    """A truncated file, or one that lists 0x1800 without 0x1A00."""
    (tmp_path / "half.eds").write_text(WHOLE)
    profile = load_profile(str(tmp_path / "half.eds"))
    drive = Drive(open_bench().network, 5, profile)
    assert len(drive.map_stream(Mode.CYCLIC_SYNCHRONOUS_POSITION).transmit) == 1


def test_a_damaged_file_never_ends_in_a_traceback(tmp_path):
    chance = random.Random(301)
    path = tmp_path / "drive.eds"
    whole = WHOLE.encode()
    path.write_bytes(whole)
    profile = load_profile(str(path))
    for _ in range(FILES):
        data = bytearray(whole)
        for _ in range(chance.choice((1, 3, 20))):
            place = chance.randrange(len(data))
            change = chance.choice(
                (b"\xff", b"[", b"]", b"=", b"\n", b"0x", b"$NODEID", b"sub", b"\x00", b";")
            )
            data[place : place + chance.randrange(0, 6)] = change
        path.write_bytes(bytes(data[: chance.randrange(len(data))] if chance.random() < 0.1 else data))
        passed_over(path, 5)
        mismatches(profile, 5)


@pytest.mark.parametrize(
    ("count", "shown"), [(4, "2001, 2002, 2003, 2004)"), (6, "2001, 2002, 2003, 2004 ...)")]
)
def test_of_many_fields_without_a_value_the_first_are_named_and_all_are_counted(tmp_path, count, shown):
    odd = "".join(
        f"[{0x2000 + k:X}]\nParameterName=p\nObjectType=what\nDataType=0x7\n" for k in range(1, count + 1)
    )
    found = read(tmp_path, WHOLE + odd)
    assert f"fields without a readable value in {count} of its objects ({shown}" in found.passed_over
