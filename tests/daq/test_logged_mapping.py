"""Logs of drives that another master mapped: read by the rig file, SDO traffic, a DCF or an EDS; else refused with the remedy."""

import struct

import numpy as np
import pytest

from daq.can_log import read_can_log
from daq.rig import RIGS, Rig
from identify.recording.errors import InputError

RIG = "rx130l-joint3-simulated"
CYCLES = 64
ENABLED = 0x0637
POSITION = [1000 + 7 * k * k for k in range(CYCLES)]
COMMAND = [(-1) ** k * 3 * k for k in range(CYCLES)]
STATUS = {0x1C3: (0x60410010, 0x60640020), 0x2C3: (0x60740010, 0x60770010)}
TARGET = {0x243: (0x60400010, 0x60600008, 0x607A0020)}
OBJECTS = {0x1A00: STATUS[0x1C3], 0x1A01: STATUS[0x2C3], 0x1600: TARGET[0x243]}
COB_IDS = {0x1800: 0x1C3, 0x1801: 0x2C3, 0x1400: 0x243}


def line(time, can_id, data, channel="can0"):
    return f"({time:.6f}) {channel} {can_id:03X}#{data.hex()}"


def stream(ours=False, sync=0x080):
    """What a drive sends and takes in some cycles: as our set-up maps it, or otherwise."""
    lines = []
    for k in range(CYCLES):
        t = 100.0 + 0.002 * k
        at = [(sync, b"")]
        if ours:
            at.append((0x183, struct.pack("<ihH", POSITION[k], COMMAND[k], ENABLED)))
            at.append((0x203, struct.pack("<Hi", 0x0F, POSITION[k])))
        else:
            at.append((0x1C3, struct.pack("<Hi", ENABLED, POSITION[k])))
            at.append((0x2C3, struct.pack("<hh", COMMAND[k], 555)))
            at.append((0x243, struct.pack("<Hbi", 0x0F, 8, POSITION[k])))
        lines += [line(t + 0.0001 * place, can_id, data) for place, (can_id, data) in enumerate(at)]
    return lines


def written(index, subindex, size, value, refused=False):
    """Request and response of an expedited download."""
    address = struct.pack("<HB", index, subindex)
    request = bytes((0x23 | (4 - size) << 2,)) + address + value.to_bytes(size, "little").ljust(4, b"\0")
    response = b"\x80" + address + struct.pack("<I", 0x06010002) if refused else b"\x60" + address + bytes(4)
    return [line(1.0, 0x603, request), line(1.0, 0x583, response)]


def read_(index, subindex, size, value):
    """Request and response of an expedited upload."""
    address = struct.pack("<HB", index, subindex)
    response = bytes((0x43 | (4 - size) << 2,)) + address + value.to_bytes(size, "little").ljust(4, b"\0")
    return [line(1.0, 0x603, b"\x40" + address + bytes(4)), line(1.0, 0x583, response)]


def set_up(transfer=written, cob_ids=COB_IDS):
    lines = []
    for mapping, entries in OBJECTS.items():
        for place, entry in enumerate(entries, 1):
            lines += transfer(mapping, place, 4, entry)
        lines += transfer(mapping, 0, 1, len(entries))
    for communication, cob_id in cob_ids.items():
        lines += transfer(communication, 1, 4, cob_id)
    return lines


def dcf(path, key="ParameterValue"):
    """Only the objects of the process data, as a configuration tool writes them."""
    sections = []
    for index, values in (
        *((index, (len(entries), *entries)) for index, entries in OBJECTS.items()),
        *((index, (2, cob_id - 3)) for index, cob_id in COB_IDS.items()),
    ):
        sections.append(f"[{index:04X}]\nParameterName=P\nObjectType=9\n")
        for subindex, value in enumerate(values):
            kind = 5 if subindex == 0 else 7
            shown = f"$NODEID+0x{value:X}" if index in COB_IDS and subindex else f"0x{value:X}"
            sections.append(
                f"[{index:04X}sub{subindex}]\nParameterName=P\nObjectType=7\nDataType={kind}\nAccessType=rw\n{key}={shown}\n"
            )
    path.write_text("".join(sections), encoding="ascii")
    return str(path)


@pytest.fixture(scope="module")
def rig():
    return Rig.load(RIG)


def with_axis(rig, **changes):
    return rig.model_copy(update={"axes": (rig.axes[0].model_copy(update=changes),)})


def rows_of(tmp_path, lines, rig):
    path = tmp_path / "bus.log"
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return read_can_log(path, rig)


def holds_what_was_sent(session):
    rows = session.rows
    assert rows["position"][:, 0].tolist() == POSITION[: len(rows)]
    assert rows["command"][:, 0].tolist() == COMMAND[: len(rows)]
    assert len(rows) >= CYCLES - 1
    np.testing.assert_array_equal(rows["setpoint"][2:, 0], POSITION[1 : len(rows) - 1])
    return "; ".join(session.remarks)


def test_our_own_mapping_needs_no_word(tmp_path, rig):
    assert "process data" not in holds_what_was_sent(rows_of(tmp_path, stream(ours=True), rig))


@pytest.mark.parametrize("transfer", [written, read_])
def test_the_set_up_in_the_log_tells_it(tmp_path, rig, transfer):
    said = holds_what_was_sent(rows_of(tmp_path, [*set_up(transfer), *stream()], rig))
    assert "node 3: its process data (0x1C3, 0x2C3) by the SDO traffic in the log" in said


def test_what_the_drive_refused_and_what_was_set_after_it_was_started_says_nothing(tmp_path, rig):
    refused = written(0x1800, 1, 4, 0x3C3, refused=True)
    start, off = [line(2.0, 0, bytes((1, 3)))], written(0x1800, 1, 4, 0x800001C3)
    lines = [*set_up(), *refused, *start, *stream(), *off]
    assert "SDO traffic" in holds_what_was_sent(rows_of(tmp_path, lines, rig))


def test_what_is_not_in_the_set_up_is_as_the_predefined_connection_set_has_it(tmp_path, rig):
    renamed = [each.replace(" 1C3#", " 183#").replace(" 2C3#", " 283#") for each in stream()]
    lines = [*set_up(cob_ids={0x1400: 0x243}), *renamed]
    assert "(0x183, 0x283) by the SDO" in holds_what_was_sent(rows_of(tmp_path, lines, rig))


@pytest.mark.parametrize(
    ("key", "by"), [("ParameterValue", "the values of of.dcf"), ("DefaultValue", "the defaults of of.dcf")]
)
def test_a_dcf_or_the_defaults_of_an_eds_tell_it(tmp_path, rig, key, by):
    named = with_axis(rig, drive=dcf(tmp_path / "of.dcf", key))
    assert f"(0x1C3, 0x2C3) by {by}" in holds_what_was_sent(rows_of(tmp_path, stream(), named))


def test_defaults_of_an_eds_that_set_up_has_changed_do_not_mislead(tmp_path, rig):
    named = with_axis(rig, drive=dcf(tmp_path / "of.eds", "DefaultValue"))
    assert "process data" not in holds_what_was_sent(rows_of(tmp_path, stream(ours=True), named))


def test_the_rig_file_tells_it(tmp_path):
    sent = "0x1C3: [0x60410010, 0x60640020], 0x2C3: [0x60740010, 0x60770010]"
    stated = f"logged_pdos: {{{sent}, 579: [0x60400010, 0x60600008, 0x607A0020]}}"
    text = (
        (RIGS / f"{RIG}.yaml")
        .read_text(encoding="utf-8")
        .replace("    node: 3\n", f"    node: 3\n    {stated}\n")
    )
    (tmp_path / "rig.yaml").write_text(text, encoding="utf-8")
    session = rows_of(tmp_path, stream(), Rig.load(tmp_path / "rig.yaml"))
    assert "(0x1C3, 0x2C3) by the rig file" in holds_what_was_sent(session)


def test_a_rig_that_is_stored_with_a_recording_tells_it(tmp_path, rig):
    document = rig.axes[0].model_dump(mode="json") | {"logged_pdos": {**STATUS, **TARGET}}
    stated = rig.model_copy(update={"axes": (type(rig.axes[0]).model_validate(document),)})
    assert "(0x1C3, 0x2C3) by the rig file" in holds_what_was_sent(rows_of(tmp_path, stream(), stated))


def test_a_sync_with_another_id_is_told_by_the_set_up_too(tmp_path, rig):
    lines = [*set_up(), *written(0x1005, 0, 4, 0x40000099), *stream(sync=0x099)]
    assert "SYNC is 0x99 (object 0x1005)" in holds_what_was_sent(rows_of(tmp_path, lines, rig))


def test_frames_of_the_same_ids_mapped_otherwise_are_told_by_their_statuswords(tmp_path, rig):
    """0x183 is as long as ours, but statusword and position stand first: by our mapping no drive would be on."""
    lines = [
        line(100.0 + 0.002 * k + place * 1e-4, can_id, data)
        for k in range(CYCLES)
        for place, (can_id, data) in enumerate(
            [(0x80, b""), (0x183, struct.pack("<Hih", ENABLED, POSITION[k], COMMAND[k]))]
        )
    ]
    stated = with_axis(rig, logged_pdos={0x183: (0x60410010, 0x60640020, 0x60740010)})
    assert rows_of(tmp_path, lines, stated).rows["position"][:, 0].tolist() == POSITION[:CYCLES]
    with pytest.raises(InputError, match="holds no 16 cycles in which all drives were enabled"):
        rows_of(tmp_path, lines, rig)


@pytest.mark.parametrize(
    ("lines", "changes", "match"),
    [
        (
            stream(),
            {},
            r"holds no frame 0x183 of node 3 \(position, command, statusword\); there are 0x80 \(0 bytes\), 0x1C3",
        ),
        (
            [*set_up(cob_ids={}), *stream(ours=True)[:10]],
            {"node": 4},
            r"holds no frame 0x184 of node 4 .*state axes\[\]\.logged_pdos in the rig file",
        ),
        (
            stream(),
            {"logged_pdos": {0x1C3: (0x60410010, 0x60640020)}},
            r"by the rig file, it has no command \(0x6074:00\) in a TPDO",
        ),
        (
            [each[:-4] if " 183#" in each else each for each in stream(ours=True)],
            {},
            "the frames of node 3 are too short for position, command, statusword",
        ),
    ],
)
def test_where_nothing_tells_it_the_remedy_is_named_in_one_line(tmp_path, rig, lines, changes, match):
    with pytest.raises(InputError, match=match) as raised:
        rows_of(tmp_path, lines, with_axis(rig, **changes))
    assert "\n" not in str(raised.value)
    assert "name the drive's DCF as axes[].drive" in str(raised.value)
