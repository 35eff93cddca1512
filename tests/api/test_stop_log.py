"""The audit rows of stops: none waited for, none lost, and not without bound in memory."""

import threading

import pytest

from api.service import stop_log
from api.service.accounts import LOCAL_OPERATOR
from api.service.stop_log import StopLog


class Log:
    """An audit log that takes nothing until `opened`."""

    def __init__(self):
        self.rows, self.opened = [], threading.Event()

    def append(self, user, action, target, outcome, *, client, details=None, at):
        self.opened.wait()
        self.rows.append((target, at, details))


@pytest.fixture
def log(monkeypatch):
    monkeypatch.setattr(stop_log, "MOST_WAITING", 3)
    return Log()


def stop(stops, count):
    for number in range(count):
        stops.append(LOCAL_OPERATOR, "POST /rigs/{rig}/stop", f"stop {number}", "200", "127.0.0.1")


def test_stops_beyond_those_that_are_kept_are_one_row_that_counts_them(log):
    times = iter(range(100))
    stops = StopLog(log, lambda: float(next(times)))
    stop(stops, 10)
    log.opened.set()
    stops.settle(60.0)
    stop(stops, 3)  # as many as are kept: none of them is counted only
    stops.settle(60.0)
    stops.close()
    assert [target for target, _, details in log.rows[4:] if details is None] == [
        "stop 0",
        "stop 1",
        "stop 2",
    ]
    assert [row[:2] for row in log.rows[:4]] == [
        ("stop 0", 0.0),
        ("stop 1", 1.0),
        ("stop 2", 2.0),
        ("stop 9", 9.0),
    ]
    assert [row[2] for row in log.rows[:3]] == [None] * 3
    assert log.rows[3][2]["stops"] == 7


def test_as_many_as_are_kept_are_written_one_by_one_again_and_again(log):
    log.opened.set()
    stops = StopLog(log, lambda: 0.0)
    for _ in range(4):
        stop(stops, 3)
        stops.settle(60.0)
    stops.close()
    assert [target for target, _, details in log.rows if details is None] == [
        "stop 0",
        "stop 1",
        "stop 2",
    ] * 4
