"""Whether a stop would be answered now, by a clock that the test sets."""

from __future__ import annotations

import asyncio

import pytest

from api.service import pulse
from api.service.pulse import OLD, LoopPulse, Pulse, StopReadiness


class Clock:
    """Stands in for the module `time`."""

    def __init__(self) -> None:
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(pulse, "time", clock)
    return clock


def test_a_pulse_is_as_old_as_its_last_beat(clock):
    heart = Pulse()
    clock.now += 0.25
    assert heart.age == 0.25
    heart.beat()
    assert heart.age == 0.0


def test_a_stop_could_come_while_every_loop_that_it_needs_takes_its_turns(clock):
    readiness, pages, acceptor = StopReadiness(), Pulse(), Pulse()
    assert readiness.could_stop_now(), "it needs no loop yet"
    readiness.depend_on("pages", pages)
    readiness.depend_on("acceptor", acceptor)
    clock.now += OLD - 0.01
    assert readiness.could_stop_now()
    clock.now += 0.01  # as old as a pulse may not be
    assert not readiness.could_stop_now()
    pages.beat()
    assert not readiness.could_stop_now(), "the acceptor still hangs"
    readiness.no_longer("acceptor")
    assert readiness.could_stop_now()
    readiness.no_longer("acceptor")  # twice is as once
    acceptor.beat()
    clock.now += OLD
    assert not readiness.could_stop_now()


def test_a_loop_marks_its_turns_from_its_start_to_its_end(clock, monkeypatch):
    monkeypatch.setattr(pulse, "PERIOD", 0.0)  # the next turn of the loop

    async def turns() -> list[float]:
        heart, ages = LoopPulse(), []
        heart.end()  # nothing to end yet
        heart.start()
        for _ in range(2):
            clock.now += 5.0
            await asyncio.sleep(0)
            await asyncio.sleep(0)
            ages.append(heart.age)
        heart.end()
        clock.now += 5.0
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        return [*ages, heart.age]

    assert asyncio.run(turns()) == [0.0, 0.0, 5.0]
