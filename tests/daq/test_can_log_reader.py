"""Logs of CAN frames as many tools write them: the same frames come out of each."""

import gzip
import os
import random
from datetime import UTC, datetime, timedelta

import can
import numpy as np
import pytest

from daq.can_log_reader import LoggedFrame, read_frames
from identify.recording.errors import InputError

START = 1_700_000_000
FRAMES = [
    (
        round(k * 0.0013 + 0.0002 * (k % 4), 6),
        0x80 if k % 3 == 0 else 0x180 + k % 3,
        bytes(range(0 if k % 3 == 0 else 1 + k % 8)),
    )
    for k in range(60)
]
"""Time (s), id, data."""
LONG = (0.03125, 0x18FF0123, bytes(3))
"""A frame with a long id among them."""
VECTOR = [
    "date Fre Mär 6 10:14:20.123 2026",
    "base hex  timestamps {}",
    "Begin Triggerblock Fre Mär 6 10:14:20 2026",
]


def spaced(data, form="02X"):
    return " ".join(format(byte, form) for byte in data)


def digits(identifier):
    return f"{identifier:08X}" if identifier > 0x7FF else f"{identifier:03X}"


def all_frames():
    return sorted([*FRAMES, LONG])


def each(form):
    """A line of every frame: form(time, id, data, seconds since the frame before)."""
    before = 0.0
    lines = []
    for time, identifier, data in all_frames():
        lines.append(form(time, identifier, data, time - before))
        before = time
    return "\n".join(lines) + "\n"


def ticks(time):
    """BUSMASTER's time of day, which passes midnight."""
    instant = datetime(2026, 11, 28, 23, 59, 59, 970_000, UTC) + timedelta(seconds=time)
    return f"{instant:%H:%M:%S}:{instant.microsecond // 100:04d}"


def local(time):
    return f"{datetime(2026, 11, 28, 12, tzinfo=UTC) + timedelta(seconds=time):%Y-%m-%d %H:%M:%S.%f}"


def vector(base, relative=False):
    """An ASC log with events that are no frames; with relative times each event counts from the one before."""
    head = "\n".join(VECTOR).format("relative" if relative else "absolute").replace("hex", base) + "\n"
    form = "X" if base == "hex" else "d"

    def line(time, identifier, data, step):
        name = format(identifier, form) + ("x" if identifier > 0x7FF else "")
        event = f"   {0.00001 if relative else time:.6f} 1  Statistic: D 10 R 0\n"
        stamp = step - (0.00001 if time else 0.0) if relative else time
        return f"{event}   {stamp:.6f} 1  {name}  Rx   d {len(data)} {spaced(data, '02X' if base == 'hex' else 'd')}"

    return head + each(line) + "End TriggerBlock\n"


def trc(version, form):
    return f";$FILEVERSION={version}\n;$STARTTIME=46354.4266\n" + each(
        lambda t, i, d, _: form.format(
            t=t * 1000, i=f"{i:04X}" if i < 0x800 else f"{i:08X}", n=len(d), d=spaced(d)
        )
    )


LOGS = {
    "candump -L": each(lambda t, i, d, _: f"({START + t:.6f}) can0 {digits(i)}#{d.hex()}"),
    "candump -L with directions": each(
        lambda t, i, d, _: f"({START + t:.6f}) can0 {digits(i)}#{d.hex().upper()} R"
    ),
    "candump -ta": each(
        lambda t, i, d, _: f" ({START + t:.6f})  can0  {digits(i)}   [{len(d)}]  {spaced(d)}"
    ),
    "candump -ta -a": each(
        lambda t, i, d, _: f" ({START + t:.6f})  can0  {digits(i)}   [{len(d)}]  {spaced(d):24}  '..3.'"
    ),
    "candump -ta -x": each(
        lambda t, i, d, _: f" ({START + t:.6f})  can0  RX - -  {digits(i)}   [{len(d)}]  {spaced(d)}"
    ),
    "candump -tA": each(lambda t, i, d, _: f" ({local(t)})  can0  {digits(i)}   [{len(d)}]  {spaced(d)}"),
    "candump -tz": each(lambda t, i, d, _: f" ({t:010.6f})  can0  {digits(i)}   [{len(d)}]  {spaced(d)}"),
    "candump -td": each(
        lambda t, i, d, step: f" ({step:010.6f})  can0  {digits(i)}   [{len(d)}]  {spaced(d)}"
    ),
    "candump in colours": each(
        lambda t, i, d, _: (
            f"\x1b[1m ({START + t:.6f})\x1b[0m  \x1b[32mcan0  {digits(i)}\x1b[0m   [{len(d)}]  {spaced(d)}"
        )
    ),
    "BUSMASTER": "***BUSMASTER Ver 3.2.2***\n***HEX***\n***SYSTEM MODE***\n"
    + each(lambda t, i, d, _: f"{ticks(t)} Rx 1 0x{i:03X} {'x' if i > 0x7FF else 's'} {len(d)} {spaced(d)}")
    + "***[STOP LOGGING SESSION]***\n",
    "Kvaser CanKing": "Chn Identifier Flg   DLC  D0...1...2...3...4...5...6..D7       Time     Dir\n"
    + each(
        lambda t, i, d, _: f" 0    {i:08X} {'X' if i > 0x7FF else ' '}   {len(d)}  {spaced(d)}      {t:.6f} R"
    ),
    "SavvyCAN": "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n"
    + each(
        lambda t, i, d, _: (
            f"{round(t * 1e6)},{i:08X},{str(i > 0x7FF).lower()},Rx,0,{len(d)},{spaced(d).replace(' ', ',')},"
        )
    ),
    "Vector": vector("hex"),
    "Vector, decimal": vector("dec"),
    "Vector, relative": vector("hex", relative=True),
    "PEAK 1.1": trc("1.1", "  1) {t:9.1f}  Rx  {i}  {n}  {d}"),
    "PEAK 1.2": trc("1.2", "  1) {t:9.3f}  1  Rx  {i}  {n}  {d}"),
    "PEAK 2.1": trc("2.1", "1 {t:9.3f} DT 1 {i} Rx - {n} {d}").replace(
        ";$STARTTIME", ";$COLUMNS=N,O,T,B,I,d,R,L,D\n;$STARTTIME"
    ),
}
COARSE = {"BUSMASTER": 1e-4, "PEAK 1.1": 1e-4}
"""s, of the times that these write."""


@pytest.mark.parametrize("tool", LOGS)
def test_the_same_frames_come_out_of_every_log(tmp_path, tool):
    path = tmp_path / "bus.txt"
    path.write_text(LOGS[tool], encoding="cp1252")
    frames, remarks = read_frames(path)
    wanted = all_frames()
    assert [frame.can_id for frame in frames] == [identifier for _, identifier, _ in wanted]
    assert [frame.data for frame in frames] == [data for _, _, data in wanted]
    assert [frame.extended for frame in frames] == [identifier > 0x7FF for _, identifier, _ in wanted]
    stamps = np.array([frame.stamp for frame in frames]) * 1e-9
    np.testing.assert_allclose(
        stamps - stamps[0], [time for time, _, _ in wanted], atol=COARSE.get(tool, 1e-6)
    )
    assert not any("damaged" in words for words in remarks)


def test_a_log_without_times_says_how_to_record_one(tmp_path):
    (tmp_path / "bus.log").write_text(
        each(lambda t, i, d, _: f"  can0  {digits(i)}   [{len(d)}]  {spaced(d)}")
    )
    with pytest.raises(InputError, match="no times; record with candump -L"):
        read_frames(tmp_path / "bus.log")


def test_damaged_lines_and_a_log_that_ends_early_are_said(tmp_path):
    lines = LOGS["candump -L"].splitlines(keepends=True)
    (tmp_path / "bus.log").write_text("".join([*lines[:20], "(17000#\n", *lines[21:-1], lines[-1][:25]]))
    frames, remarks = read_frames(tmp_path / "bus.log")
    assert len(frames) == len(lines) - 2
    assert remarks[-1] == "2 lines without a whole frame passed over"
    (tmp_path / "bus.trc").write_text(LOGS["PEAK 2.1"] + "62 90.000 DT 1 01")
    frames, remarks = read_frames(tmp_path / "bus.trc")
    assert len(frames) == len(lines)
    assert remarks == ["1 line without a whole frame passed over"]
    (tmp_path / "bus.asc").write_text(
        LOGS["Vector"]
        + "   0.090000 1  183  Rx   d 8 0\udc80".encode("utf-8", "surrogateescape").decode("latin-1")
    )
    frames, remarks = read_frames(tmp_path / "bus.asc")
    assert len(frames) == len(lines)
    assert "damaged or cut short after 0.0773 s: read up to there" in remarks[-1]


def test_a_packed_log_that_is_cut_and_what_is_no_log_are_refused(tmp_path):
    (tmp_path / "bus.log.gz").write_bytes(gzip.compress(LOGS["candump -L"].encode())[:-20])
    with pytest.raises(InputError, match="gzip file is damaged or cut short"):
        read_frames(tmp_path / "bus.log.gz")
    (tmp_path / "bus.txt").write_text("t,q,i\n1,2,3\n")
    with pytest.raises(InputError, match="Logs are those of candump, BUSMASTER, Kvaser"):
        read_frames(tmp_path / "bus.txt")


@pytest.mark.parametrize("tool", LOGS)
def test_a_damaged_log_is_read_or_refused_in_one_line(tmp_path, tool):
    chance = random.Random(14)
    whole = LOGS[tool].encode("cp1252")
    for _ in range(int(os.environ.get("COULOMB_FUZZED_FILES", "150")) // 10):
        data = bytearray(whole)
        for _ in range(chance.choice((1, 3, 20))):
            place = chance.randrange(len(data))
            data[place : place + chance.randrange(0, 30)] = chance.choice(
                (b"", b"\n", b"9" * 400, b"\xff", b"#", b"-1", b"x")
            )
        (tmp_path / "bus.txt").write_bytes(bytes(data[: chance.randrange(1, len(data))]))
        frames: list[LoggedFrame] = []
        try:
            frames, said = read_frames(tmp_path / "bus.txt")
        except InputError as refused:
            said = [str(refused)]
        assert all(len(frame.data) <= 8 and abs(frame.stamp) < 2**63 for frame in frames)
        assert not any("\n" in words for words in said)


@pytest.mark.parametrize("seed", range(6))
def test_a_blf_log_whose_objects_have_no_length_or_late_times_ends(tmp_path, seed):
    path = tmp_path / "bus.blf"
    with can.BLFWriter(path, compression_level=0) as writer:
        for time, identifier, data in FRAMES:
            message = can.Message(time + 1, identifier, is_extended_id=False, data=data, channel=1)
            writer.on_message_received(message)
    whole = bytearray(path.read_bytes())
    objects = [place for place in range(len(whole)) if whole[place : place + 4] == b"LOBJ"]
    place = objects[2 + 7 * seed]
    whole[place + 8 : place + 12] = bytes(4)  # its length
    whole[place + 6 : place + 7] = bytes([seed])  # the version of its header
    whole[place + 12 : place + 13] = bytes([seed])  # its kind
    path.write_bytes(bytes(whole))
    try:
        frames, said = read_frames(path)
    except InputError as refused:
        frames, said = [], [str(refused)]
    assert len(frames) <= len(FRAMES)
    assert any("damaged or cut short" in words for words in said)


def test_a_time_beyond_any_clock_is_a_damaged_line(tmp_path):
    lines = LOGS["candump -L"].splitlines(keepends=True)
    (tmp_path / "bus.log").write_text("".join([*lines, "(9900000000.000000) can0 080#\n"]))
    frames, remarks = read_frames(tmp_path / "bus.log")
    assert len(frames) == len(lines)
    assert remarks[-1] == "1 line without a whole frame passed over"


def test_a_log_that_a_windows_shell_has_redirected_is_read(tmp_path):
    (tmp_path / "bus.log").write_text(LOGS["candump -L"], encoding="utf-16")
    frames, _ = read_frames(tmp_path / "bus.log")
    assert [frame.data for frame in frames] == [data for _, _, data in all_frames()]
