"""RealTime is tested on a clock of the test's own: what it does with time is arithmetic, not luck."""

import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers import sync_producer
from drivers.sync_producer import (
    LATENESS_CLASSES_US,
    SYNC_ID,
    AsAnswered,
    RealTime,
    SimulatedClock,
    SyncProducer,
    SyncStatistics,
)

PERIOD = 0.001
NS = 1_000_000  # of a period


class HandClock:
    """Time that passes when slept, and `oversleep` ns more each time."""

    def __init__(self):
        self.now = 5_000_000
        self.oversleep = [0]

    def monotonic_ns(self):
        return self.now

    def monotonic(self):
        return self.now * 1e-9

    def sleep(self, seconds):
        self.now += round(seconds * 1e9) + self.oversleep.pop(0)
        self.oversleep = self.oversleep or [0]


@pytest.fixture
def clock(monkeypatch):
    hand = HandClock()
    monkeypatch.setattr(sync_producer, "time", hand)
    return hand


def run(clock, cycles, on_cycle=None):
    sent = []
    producer = SyncProducer(lambda can_id, data: sent.append(clock.now), PERIOD, RealTime(), on_cycle)
    producer.run(cycles)
    return np.array(sent), producer


def test_lateness_of_one_sync_does_not_shift_the_next(clock):
    clock.oversleep = [300_000, 0, 900_000, 0, 0]
    start = clock.now
    sent, producer = run(clock, 5)
    expected = start + NS * np.arange(1, 6) + [300_000, 0, 900_000, 0, 0]
    assert sent.tolist() == expected.tolist()
    assert producer.statistics.missed == 0
    assert producer.statistics.worst_lateness == pytest.approx(0.0009)
    assert producer.statistics.mean_lateness == pytest.approx(0.0012 / 5)


def test_after_a_stall_missed_cycles_are_counted_and_not_sent_in_a_burst(clock):
    clock.oversleep = [0, 3_400_000, 0, 0]
    start = clock.now
    sent, producer = run(clock, 4)
    assert producer.statistics.missed == 3
    assert sent.tolist() == [start + NS, start + 5_400_000, start + 6 * NS, start + 7 * NS]


def test_a_callback_that_takes_longer_than_the_period_is_counted(clock):
    def slow(cycle):
        clock.now += 1_500_000 if cycle == 1 else 0

    _, producer = run(clock, 3, slow)
    assert producer.statistics.slow_callbacks == 1


@given(st.lists(st.floats(0, 0.05), min_size=1, max_size=50))
def test_the_histogram_counts_every_cycle_once_in_its_class(lateness):
    statistics = SyncStatistics()
    for late in lateness:
        statistics.count(late)
    edges = np.array([0, *LATENESS_CLASSES_US, np.inf]) * 1e-6
    expected, _ = np.histogram(lateness, bins=edges)
    assert sum(statistics.lateness_histogram) == len(lateness) == statistics.sent
    near_an_edge = any(np.isclose(late, edges).any() for late in lateness)
    assert near_an_edge or statistics.lateness_histogram == expected.tolist()


def test_every_frame_is_sync_and_every_cycle_is_announced_once():
    frames, cycles = [], []
    producer = SyncProducer(
        lambda can_id, data: frames.append((can_id, data)), PERIOD, AsAnswered(), cycles.append
    )
    producer.run(10)
    producer.run(5)
    assert frames == [(SYNC_ID, b"")] * 15
    assert cycles == list(range(15))
    assert producer.cycle == 14


def test_as_answered_asks_for_the_last_cycle_and_counts_silence():
    asked = []

    def answered(cycle, timeout):
        asked.append((cycle, timeout))
        return cycle != 1

    producer = SyncProducer(lambda *frame: None, PERIOD, AsAnswered(answered, timeout=0.2))
    producer.run(4)
    assert asked == [(0, 0.2), (1, 0.2), (2, 0.2)]
    assert producer.statistics.missed == 1


def test_simulated_time_advances_by_one_period_before_each_sync():
    clock, stamps = SimulatedClock(), []
    pacing = AsAnswered(advance=clock.advance)
    SyncProducer(lambda *frame: stamps.append(clock()), 0.002, pacing).run(3)
    assert stamps == [2 * NS, 4 * NS, 6 * NS]


def test_what_fails_in_the_thread_is_raised_by_stop():
    failed = threading.Event()

    def fail(cycle):
        failed.set()
        raise RuntimeError("setpoints ran out")

    producer = SyncProducer(lambda *frame: None, PERIOD, AsAnswered(), fail)
    producer.start()
    assert failed.wait(5.0)
    with pytest.raises(RuntimeError, match="setpoints ran out"):
        producer.stop()


def test_start_and_stop_in_real_time_send_about_as_many_as_time_allows():
    sent, enough = [], threading.Event()

    def count(can_id, data):
        sent.append(can_id)
        if len(sent) == 20:
            enough.set()

    producer = SyncProducer(count, 0.002, RealTime())
    producer.start()
    with pytest.raises(RuntimeError, match="already"):
        producer.start()
    assert enough.wait(10.0)
    producer.stop()
    assert not producer.running
    assert producer.statistics.sent == len(sent) >= 20


def test_request_stop_from_the_callback_ends_after_that_cycle():
    producer = SyncProducer(lambda *frame: None, PERIOD, AsAnswered())
    producer.on_cycle = lambda cycle: producer.request_stop() if cycle == 3 else None
    producer.run()
    assert producer.cycle == 3


def test_a_period_of_zero_is_refused():
    with pytest.raises(ValueError, match="must be positive"):
        SyncProducer(lambda *frame: None, 0.0, RealTime())


def test_the_classes_of_lateness_go_by_one_two_five_from_ten_microseconds_to_ten_milliseconds():
    decades = [step * 10**power for power in (1, 2, 3) for step in (1, 2, 5)]
    assert list(LATENESS_CLASSES_US) == [*decades, 10_000]
