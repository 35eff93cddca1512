"""Rows on SYNC, against a reference that is slow and obvious: it walks the frames one by one."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.alignment import SYNC_ID, SyncAlignment

PERIOD = 0.001
T = 1_000_000  # ns

FRAME = np.dtype(
    {
        "names": ["stamp", "can_id", "flags", "length", "data"],
        "formats": ["<i8", "<u4", "u1", "u1", ("u1", (8,))],
        "offsets": [0, 8, 12, 13, 16],
        "itemsize": 24,
    }
)


def frames(events: list[tuple[int, int, int]]) -> np.ndarray:
    """(stamp, CAN id, number in the first four bytes) per frame."""
    block = np.zeros(len(events), FRAME)
    for row, (stamp, identifier, number) in zip(block, events, strict=True):
        row["stamp"], row["can_id"], row["length"] = stamp, identifier, 8
        row["data"][:4] = np.frombuffer(np.int32(number).tobytes(), np.uint8)
    return block


def aligner(columns: int) -> SyncAlignment:
    return SyncAlignment({0x181 + column: 8 for column in range(columns)}, PERIOD)


def numbers(rows) -> np.ndarray:
    return rows.data[:, :, :4].copy().view(np.int32)[:, :, 0]


def align_in_blocks(columns: int, events, cuts) -> tuple[dict, SyncAlignment]:
    """All rows, the frames having come in blocks that end at `cuts`."""
    aligned = aligner(columns)
    block = frames(events)
    edges = sorted({0, len(block), *(cut % (len(block) + 1) for cut in cuts)})
    parts = [aligned.feed(block[a:b]) for a, b in itertools.pairwise(edges)] + [aligned.flush()]
    return {
        "cycle": np.concatenate([part.cycle for part in parts]),
        "time": np.concatenate([part.sync_time for part in parts]),
        "seen": np.concatenate([part.sync_seen for part in parts]),
        "number": np.concatenate([numbers(part) for part in parts]),
        "came": np.concatenate([part.came for part in parts]),
        "late": np.concatenate([part.late for part in parts]),
    }, aligned


def reference(columns: int, events) -> list[dict]:
    """One frame after the other, with lists."""
    cycles = []  # each: [stamp of SYNC, seen, {column: [(stamp, number), …]}]
    for stamp, identifier, number in events:
        if identifier == SYNC_ID:
            cycles.append([stamp, True, {column: [] for column in range(columns)}])
        elif cycles:
            cycles[-1][2][identifier - 0x181].append((stamp, number))
    index = 0
    while index + 1 < len(cycles):
        start, _, received = cycles[index]
        end = cycles[index + 1][0]
        missing = int(np.rint((end - start) / T)) - 1
        twice = sum(
            len(received[c]) >= 2 and (index == 0 or len(cycles[index - 1][2][c]) > 0) for c in range(columns)
        )
        if missing > 0 and 2 * twice > columns:
            cuts = min(missing, max(len(received[c]) for c in range(columns)) - 1)
            times = [start] + [start + (end - start) * cut // (cuts + 1) for cut in range(1, cuts + 1)]
            parts = [[time, time == start and cycles[index][1], {}] for time in times]
            for column in range(columns):
                for number, time in enumerate(times):
                    until = times[number + 1] if number + 1 < len(times) else float("inf")
                    since = time if number else float("-inf")
                    parts[number][2][column] = [f for f in received[column] if since <= f[0] < until]
            cycles[index : index + 1] = parts
            continue
        index += 1
    rows = [
        {"time": start, "seen": seen, "value": [None] * columns, "late": [False] * columns, "surplus": 0}
        for start, seen, _ in cycles
    ]
    for index, (_, _, received) in enumerate(cycles):
        for column in range(columns):
            own = list(received[column])
            if index and len(own) >= 2 and not cycles[index - 1][2][column]:
                rows[index - 1]["value"][column] = own.pop(0)[1]
                rows[index - 1]["late"][column] = True
            if own:
                rows[index]["value"][column] = own[-1][1]
                rows[index]["surplus"] += len(own) - 1
    return rows


@st.composite
def traffic(draw):
    """A bus with one to six drives: PDOs lost, late, repeated; SYNCs lost or stalled."""
    columns = draw(st.integers(1, 6))
    cycles = draw(st.integers(0, 12))
    fate = st.sampled_from(["comes"] * 12 + ["lost", "late", "twice", "very late"])
    events = []
    now = 0
    waiting = []
    for cycle in range(cycles):
        now += draw(st.sampled_from([T] * 8 + [T + T // 10, 2 * T, 3 * T]))
        if draw(st.integers(0, 9)) > 0:
            events.append((now, SYNC_ID, 0))
        order = draw(st.permutations(range(columns)))
        arriving, waiting = waiting, []
        events += [(now + 20_000 + i, *frame) for i, frame in enumerate(arriving)]
        for place, column in enumerate(order):
            frame = (0x181 + column, 10 * cycle + column)
            match draw(fate):
                case "comes":
                    events.append((now + 100_000 + place * 100_000, *frame))
                case "twice":
                    events += [(now + 100_000 + place * 100_000, *frame)] * 2
                case "late":
                    waiting.append(frame)
                case "very late":
                    waiting.append(frame)
                    events.append((now + 100_000 + place * 100_000, *frame))
    return columns, events


@settings(max_examples=600, deadline=None)
@given(traffic(), st.lists(st.integers(0, 100), max_size=6))
def test_rows_are_those_of_the_reference_however_the_frames_were_cut_into_blocks(bus, cuts):
    columns, events = bus
    rows, aligned = align_in_blocks(columns, events, cuts)
    expected = reference(columns, events)
    assert len(rows["cycle"]) == len(expected)
    np.testing.assert_array_equal(rows["cycle"], np.arange(len(expected)))
    for index, row in enumerate(expected):
        assert rows["time"][index] == row["time"]
        assert rows["seen"][index] == row["seen"]
        for column, value in enumerate(row["value"]):
            assert rows["came"][index, column] == (value is not None)
            assert rows["number"][index, column] == (value or 0)
            assert rows["late"][index, column] == row["late"][column]
    counters = aligned.counters
    assert counters.lost.sum() == sum(value is None for row in expected for value in row["value"])
    assert counters.late.sum() == sum(sum(row["late"]) for row in expected)
    assert counters.surplus.sum() == sum(row["surplus"] for row in expected)
    assert counters.lost_sync == sum(not row["seen"] for row in expected)


def healthy(columns: int, cycles: int) -> list[tuple[int, int, int]]:
    events = []
    for cycle in range(cycles):
        events.append((cycle * T, SYNC_ID, 0))
        events += [(cycle * T + 100_000 * (c + 1), 0x181 + c, 10 * cycle + c) for c in range(columns)]
    return events


def test_a_healthy_bus_gives_one_full_row_per_sync():
    rows, aligned = align_in_blocks(3, healthy(3, 5), [])
    np.testing.assert_array_equal(rows["number"], [[10 * k + c for c in range(3)] for k in range(5)])
    assert rows["came"].all()
    assert not rows["late"].any()
    assert aligned.counters.to_json() == {
        "lost": [0, 0, 0], "late": [0, 0, 0], "surplus": [0, 0, 0],
        "lost_sync": 0, "before_first_sync": 0, "too_short": 0,
    }  # fmt: skip


def test_a_pdo_that_did_not_come_is_marked_and_not_filled_in():
    events = [event for event in healthy(2, 4) if event[2] != 11]
    rows, _ = align_in_blocks(2, events, [])
    np.testing.assert_array_equal(rows["came"], [[1, 1], [1, 0], [1, 1], [1, 1]])
    assert rows["number"][1, 1] == 0


def test_a_late_pdo_goes_back_to_its_cycle_and_is_marked():
    events = healthy(2, 4)
    late = next(event for event in events if event[2] == 11)
    events.remove(late)
    behind_sync = events.index((2 * T, SYNC_ID, 0)) + 1
    events.insert(behind_sync, (2 * T + 1000, late[1], late[2]))
    rows, _ = align_in_blocks(2, events, [])
    assert rows["came"].all()
    np.testing.assert_array_equal(rows["number"][:, 1], [1, 11, 21, 31])
    np.testing.assert_array_equal(rows["late"], [[0, 0], [0, 1], [0, 0], [0, 0]])


@pytest.mark.parametrize("columns", [1, 2, 6])
def test_a_lost_sync_is_put_back_and_marked_as_not_seen(columns):
    events = healthy(columns, 6)
    events.remove((3 * T, SYNC_ID, 0))
    rows, aligned = align_in_blocks(columns, events, [])
    np.testing.assert_array_equal(rows["number"][:, 0], [0, 10, 20, 30, 40, 50])
    np.testing.assert_array_equal(rows["seen"], [1, 1, 1, 0, 1, 1])
    assert rows["time"][3] == 3 * T
    assert aligned.counters.lost_sync == 1


def test_a_stalled_sync_invents_no_row():
    events = []
    for cycle, start in enumerate([0, T, 2 * T, 9 * T, 10 * T]):
        events += [(start, SYNC_ID, 0), (start + 100_000, 0x181, cycle)]
    rows, _ = align_in_blocks(1, events, [])
    np.testing.assert_array_equal(rows["number"][:, 0], [0, 1, 2, 3, 4])


def test_a_row_is_final_only_at_the_second_sync_after_it():
    aligned = aligner(1)
    assert len(aligned.feed(frames([(0, SYNC_ID, 0), (1, 0x181, 1), (T, SYNC_ID, 0)]))) == 0
    assert len(aligned.feed(frames([(T + 1, 0x181, 2)]))) == 0
    assert len(aligned.feed(frames([(2 * T, SYNC_ID, 0)]))) == 1


def test_frames_that_are_nobodys_are_ignored_and_short_ones_counted():
    block = frames([(0, SYNC_ID, 0), (1, 0x181, 5), (2, 0x181, 6), (3, 0x705, 7), (4, 0x181, 8)])
    block["length"][2] = 4  # shorter than mapped
    block["flags"][4] = 0x01  # a 29-bit id
    aligned = aligner(1)
    aligned.feed(block)
    rows = aligned.flush()
    assert numbers(rows).tolist() == [[5]]
    assert aligned.counters.too_short == 1
    assert aligned.counters.surplus.sum() == 0


def test_pdos_before_the_first_sync_are_counted_and_left_out():
    rows, aligned = align_in_blocks(1, [(0, 0x181, 9), (1, 0x181, 9), *healthy(1, 3)], [1, 2])
    assert rows["number"][:, 0].tolist() == [0, 10, 20]
    assert aligned.counters.before_first_sync == 2
