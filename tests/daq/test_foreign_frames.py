"""Frames that only we may send: ours pass, as many as were sent; one more is another master."""

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from daq.foreign_frames import ForeignFrames, ids_of_ours
from daq.safety import StopCause
from drivers.frames import ERROR, EXTENDED, FRAME, OWN

MASTER = 127
STREAMS = [
    SimpleNamespace(node=5, receive=SimpleNamespace(can_id=0x205)),
    SimpleNamespace(node=6, receive=SimpleNamespace(can_id=0x206)),
]


@pytest.fixture
def counted() -> Counter[int]:
    """How many frames with an id went out by canopen."""
    return Counter()


@pytest.fixture
def watch(counted) -> ForeignFrames:
    counted[0x000] = 4  # while the drives were set up
    return ForeignFrames(STREAMS, MASTER, lambda can_id: counted[can_id])


def block(*frames: tuple[int, int], data: bytes = b"\x01\x02") -> np.ndarray:
    """Frames (can_id, flags)."""
    made = np.zeros(len(frames), FRAME)
    for row, (can_id, flags) in zip(made, frames, strict=True):
        row["can_id"], row["flags"] = can_id, flags
        row["data"][: len(data)] = np.frombuffer(data, np.uint8)
    return made


def test_a_receiver_is_asked_to_pass_all_that_only_we_may_send():
    assert sorted(ids_of_ours(STREAMS, MASTER)) == [0x000, 0x205, 0x206, 0x605, 0x606, 0x77F]


def test_our_own_sync_is_kept_and_the_echo_of_our_setpoints_is_not(watch):
    kept, reason = watch.take(block((0x80, OWN), (0x205, OWN), (0x185, 0), (0x80, OWN)))
    assert reason is None
    assert kept["can_id"].tolist() == [0x80, 0x185, 0x80]
    assert watch.count == 0


def test_a_foreign_sync_is_taken_out_and_named(watch):
    kept, reason = watch.take(block((0x80, OWN), (0x80, 0)))
    assert kept["can_id"].tolist() == [0x80]
    assert reason is not None
    assert reason.cause is StopCause.FOREIGN_MASTER
    assert "a SYNC (0x080) that is not ours; find it" in reason.words
    assert watch.count == 1


def test_foreign_setpoints_are_kept_for_the_record_and_named_with_node_and_data(watch):
    kept, reason = watch.take(block((0x206, 0), data=b"\x0f\x00\xff"))
    assert kept["can_id"].tolist() == [0x206]
    assert "setpoints (0x206) for node 6 that are not ours (data 0F 00 FF" in reason.words


@pytest.mark.parametrize(
    ("can_id", "words"),
    [
        (0x000, "an NMT command (0x000)"),
        (0x77F, "a heartbeat under our node id 127 (0x77F)"),
        (0x606, "an SDO request to node 6 (0x606)"),
    ],
)
def test_one_frame_more_than_were_sent_is_somebody_elses(watch, counted, can_id, words):
    counted[can_id] += 2
    assert watch.take(block((can_id, 0), (can_id, 0)))[1] is None
    reason = watch.take(block((can_id, 0)))[1]
    assert words in reason.words
    counted[can_id] += 2
    # the stranger's has used up one that was ours
    assert watch.take(block((can_id, 0)))[1] is None
    assert watch.take(block((can_id, 0)))[1] is not None
    assert watch.count == 2


def test_what_was_sent_before_the_watch_began_is_no_credit(watch, counted):
    assert watch.take(block((0x000, 0)))[1] is not None


def test_our_last_heartbeat_may_come_late_from_a_slow_adapter_and_no_other(counted):
    counted[0x77F] = 3
    watch = ForeignFrames(STREAMS, MASTER, lambda can_id: counted[can_id])
    assert watch.take(block((0x77F, 0)))[1] is None
    assert watch.take(block((0x77F, 0)))[1] is not None


@pytest.mark.parametrize("flags", [EXTENDED, ERROR])
def test_extended_identifiers_and_error_frames_are_nobodys_setpoints(watch, flags):
    kept, reason = watch.take(block((0x205, flags), (0x80, flags)))
    assert reason is None
    assert len(kept) == 2
