"""The raw log read again by python-can's reader of can-utils' format, and who may write one."""

import gzip

import can
import numpy as np
import pytest

from daq.raw_log import RawLog, mend, raw_log_of, text_of
from drivers.frames import BITRATE_SWITCH, ERROR, EXTENDED, FD, FD_FRAME, FRAME, REMOTE


def frames(dtype, *rows):
    made = np.zeros(len(rows), dtype)
    for row, (stamp, can_id, flags, data) in zip(made, rows, strict=True):
        row["stamp"], row["can_id"], row["flags"], row["length"] = stamp, can_id, flags, len(data)
        row["data"][: len(data)] = np.frombuffer(data, np.uint8)
    return made


def read(path):
    with can.LogReader(path) as reader:
        return list(reader)


def test_every_kind_of_frame_is_read_as_it_was(tmp_path):
    log = RawLog(tmp_path / "a.log", "can0")
    log.append(
        frames(
            FRAME,
            (1_500_000_000, 0x181, 0, b"\x01\x02\xff"),
            (1_500_001_999, 0x80, 0, b""),
            (2_000_000_000, 0x12345, EXTENDED, b"\x07"),
            (2_000_000_001, 0x701, REMOTE, b""),
        )
    )
    log.append(frames(FRAME))
    log.close()
    log.close()
    assert log.frames == 4
    first, sync, extended, remote = read(tmp_path / "a.log")
    assert (first.arbitration_id, bytes(first.data), first.timestamp) == (0x181, b"\x01\x02\xff", 1.5)
    assert (sync.arbitration_id, sync.dlc, sync.channel) == (0x80, 0, "can0")
    assert (extended.arbitration_id, extended.is_extended_id) == (0x12345, True)
    assert not first.is_extended_id
    assert remote.is_remote_frame
    # microseconds, cut and not rounded, as candump writes them
    assert (tmp_path / "a.log").read_text().splitlines()[1] == "(1.500001) can0 080#"


@pytest.mark.parametrize(("flags", "switched"), [(FD, False), (FD | BITRATE_SWITCH, True)])
def test_fd_frames_keep_their_length_and_the_switch_of_bit_rate(tmp_path, flags, switched):
    data = bytes(range(48))
    with_log = RawLog(tmp_path / "fd.log", "can1")
    with_log.append(frames(FD_FRAME, (10**9, 0x200, flags, data)))
    with_log.close()
    (frame,) = read(tmp_path / "fd.log")
    assert frame.is_fd
    assert frame.bitrate_switch is switched
    assert bytes(frame.data) == data


def test_an_error_frame_has_the_kernel_s_flag_in_its_id(tmp_path):
    log = RawLog(tmp_path / "e.log", "can0")
    log.append(frames(FRAME, (10**9, 0x4, ERROR, b"\x00" * 8)))
    log.flush(to_disk=True)
    assert (tmp_path / "e.log").read_text() == "(1.000000) can0 20000004#0000000000000000\n"
    log.close()


@pytest.mark.parametrize(("channel", "written"), [("my adapter 1", "my_adapter_1"), ("  ", "can")])
def test_a_channel_is_one_word(tmp_path, channel, written):
    log = RawLog(tmp_path / "c.log", channel)
    log.append(frames(FRAME, (0, 1, 0, b"")))
    log.close()
    assert (tmp_path / "c.log").read_text().split()[1] == written


def test_a_log_has_one_writer_and_holds_one_session(tmp_path):
    path = tmp_path / "a.log"
    log = RawLog(path, "can0")
    with pytest.raises(FileExistsError):
        RawLog(path, "can0")
    with pytest.raises(FileExistsError, match="another recorder"):
        RawLog(path, "can0", claimed=True)
    log.append(frames(FRAME, (0, 1, 0, b"")))
    log.close()
    with pytest.raises(FileExistsError, match="another session"):
        RawLog(path, "can0", claimed=True)
    (tmp_path / "claimed.log").touch()
    RawLog(tmp_path / "claimed.log", "can0", claimed=True).close()


def compressed(path, blocks=3):
    """A compressed log of that many blocks, closed, and its text."""
    log = RawLog(path, "can0")
    for block in range(blocks):
        log.append(frames(FRAME, *((10**9 * block + k, 0x181, 0, bytes([k])) for k in range(200))))
        log.flush()
    log.close()
    return gzip.decompress(path.read_bytes())


def test_a_compressed_log_is_read_by_others(tmp_path):
    text = compressed(tmp_path / "a.log.gz")
    assert len(read(tmp_path / "a.log.gz")) == 600
    assert b"".join(text_of(tmp_path / "a.log.gz")) == text
    (tmp_path / "b.log").write_bytes(text)
    assert b"".join(text_of(tmp_path / "b.log")) == text


@pytest.mark.parametrize("lost", [1, 9, 60, 300])
def test_what_was_flushed_before_a_kill_is_read_and_mended(tmp_path, lost):
    """The last block lacks bytes, as after a power cut; everything before it is there."""
    path = tmp_path / "a.log.gz"
    text = compressed(path)
    path.write_bytes(path.read_bytes()[:-lost])
    (whole,) = {b"".join(text_of(path))}
    assert text.startswith(whole)
    assert whole.count(b"\n") == 400
    mend(path)
    assert gzip.decompress(path.read_bytes()) == whole
    mend(path)
    assert gzip.decompress(path.read_bytes()) == whole


def test_a_torn_line_of_an_uncompressed_log_is_cut(tmp_path):
    path = tmp_path / "a.log"
    path.write_bytes(b"(0.000001) can0 080#\n(0.0000")
    mend(path)
    assert path.read_bytes() == b"(0.000001) can0 080#\n"


def test_frames_that_the_disk_did_not_take_are_written_later_and_leave_no_torn_block(tmp_path, monkeypatch):
    path = tmp_path / "a.log.gz"
    log = RawLog(path, "can0")
    log.append(frames(FRAME, (0, 1, 0, b"")))
    log.flush()

    class Full:
        """Takes half of what is asked once, then refuses."""

        def __init__(self, file):
            self._file, self._took = file, False

        def write(self, block):
            if self._took:
                raise OSError(28, "No space left on device")
            self._took = True
            return self._file.write(block[: len(block) // 2])

        def __getattr__(self, name):
            return getattr(self._file, name)

    real = log._file
    monkeypatch.setattr(log, "_file", Full(real))
    log.append(frames(FRAME, (10**9, 2, 0, b"")))
    with pytest.raises(OSError, match="No space"):
        log.flush()
    assert gzip.decompress(path.read_bytes()) == b"(0.000000) can0 001#\n"
    monkeypatch.setattr(log, "_file", real)
    log.close()
    assert gzip.decompress(path.read_bytes()) == b"(0.000000) can0 001#\n(1.000000) can0 002#\n"


def test_a_recording_of_an_earlier_version_has_its_log_uncompressed(tmp_path):
    assert raw_log_of(tmp_path / "session-00.h5").name == "session-00.log.gz"
    (tmp_path / "session-00.log").touch()
    assert raw_log_of(tmp_path / "session-00.h5").name == "session-00.log"
