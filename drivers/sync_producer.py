"""SYNC, the clock of the rig: one frame per cycle, from a thread with absolute deadlines.

The kernel's own cyclic transmission (BCM) is not used: it re-arms from "now" and therefore drifts, and it
goes on sending while our process hangs, which is no proof of life and a danger with setpoints.

Pacing is a policy. `RealTime` waits for absolute deadlines k·T, so that lateness does not add up.
`AsAnswered` sends the next SYNC as soon as the nodes have answered the last one, for simulated rigs.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

SYNC_ID = 0x80  # CiA 301, object 0x1005

# Cycle's lateness is counted in these classes, µs; the last is open.
LATENESS_CLASSES_US = (10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000)


class Pacing(Protocol):
    """When the next SYNC goes out; `missed` counts the SYNCs that could not go out in time."""

    missed: int

    def start(self, period: float) -> None:
        """Called once before the first SYNC; period in s."""
        ...

    def wait(self, cycle: int) -> float:
        """Return when SYNC `cycle` is due; the value is how late it is, in s (0 where that means nothing)."""
        ...


class RealTime:
    """SYNC k is due at start + k·period on the monotonic clock.

    After a stall longer than a period the missed SYNCs are not sent in a burst: the deadlines move by whole
    periods and the cycles between are counted as missed.
    """

    def __init__(self) -> None:
        self.missed = 0
        self._period = 0
        self._next = 0

    def start(self, period: float) -> None:
        """Begin to count deadlines from now; period in s."""
        self._period = round(period * 1e9)
        self._next = time.monotonic_ns() + self._period

    def wait(self, cycle: int) -> float:
        """Sleep until the next deadline; how late it was met, in s."""
        remaining = self._next - time.monotonic_ns()
        if remaining > 0:
            time.sleep(remaining * 1e-9)
        late = max(0, time.monotonic_ns() - self._next)
        skipped = late // self._period
        self.missed += skipped
        self._next += (skipped + 1) * self._period
        return late * 1e-9


class AsAnswered:
    """SYNC k+1 is due when `answered(k, timeout)` returns.

    answered : returns True once every node has answered SYNC k, False when `timeout` (s) passed first; None
               where a node answers before `send` returns
    timeout  : s to wait for an answer before the cycle counts as missed
    advance  : called with the period in ns before each SYNC, to move a simulated clock
    """

    def __init__(
        self,
        answered: Callable[[int, float], bool] | None = None,
        timeout: float = 0.5,
        advance: Callable[[int], None] | None = None,
    ):
        self.missed = 0
        self.answered = answered
        self.timeout = timeout
        self.advance = advance
        self._period = 0

    def start(self, period: float) -> None:
        """Take the period, in s, by which simulated time goes on at each SYNC."""
        self._period = round(period * 1e9)

    def wait(self, cycle: int) -> float:
        """Wait for the answers to SYNC `cycle` − 1, then move the simulated clock; always 0."""
        if cycle and self.answered is not None and not self.answered(cycle - 1, self.timeout):
            self.missed += 1
        if self.advance is not None:
            self.advance(self._period)
        return 0.0


class SimulatedClock:
    """Time that passes only when SYNC says so; ns."""

    def __init__(self, start: int = 0):
        self.now = start

    def __call__(self) -> int:
        return self.now

    def advance(self, duration: int) -> None:
        """Let `duration` ns pass."""
        self.now += duration


@dataclass
class SyncStatistics:
    """How SYNC went so far.

    sent                : cycles sent
    missed              : deadlines that passed without a SYNC
    worst_lateness      : s
    mean_lateness       : s
    lateness_histogram  : cycles per class of LATENESS_CLASSES_US, one more for what is later still
    slow_callbacks      : cycles whose `on_cycle` took longer than the period
    """

    sent: int = 0
    missed: int = 0
    worst_lateness: float = 0.0
    total_lateness: float = 0.0
    lateness_histogram: list[int] = field(default_factory=lambda: [0] * (len(LATENESS_CLASSES_US) + 1))
    slow_callbacks: int = 0

    @property
    def mean_lateness(self) -> float:
        """s, over all cycles sent."""
        return self.total_lateness / self.sent if self.sent else 0.0

    def count(self, lateness: float) -> None:
        """Take one cycle's lateness (s) into account."""
        self.sent += 1
        self.total_lateness += lateness
        self.worst_lateness = max(self.worst_lateness, lateness)
        microseconds = lateness * 1e6
        for position, limit in enumerate(LATENESS_CLASSES_US):
            if microseconds < limit:
                self.lateness_histogram[position] += 1
                return
        self.lateness_histogram[-1] += 1


class SyncProducer:
    """Sends SYNC and lets the caller prepare the next cycle.

    send     : `send(can_id, data)`, usually a FrameReceiver's, so that every SYNC is seen and stamped among
               the frames received
    period   : s
    pacing   : RealTime() or AsAnswered(...)
    on_cycle : called with k right after SYNC k went out; the setpoints it sends take effect at SYNC k+1.
               What it raises ends the production and is raised by `run` and `stop`.

    Either `run(cycles)` in the caller's own thread, or `start()` and `stop()`.
    """

    def __init__(
        self,
        send: Callable[[int, bytes], None],
        period: float,
        pacing: Pacing,
        on_cycle: Callable[[int], None] | None = None,
    ):
        if period <= 0:
            raise ValueError(f"the SYNC period must be positive, not {period} s")
        self.send = send
        self.period = period
        self.pacing = pacing
        self.on_cycle = on_cycle
        self.cycle = -1  # the last SYNC sent
        self.statistics = SyncStatistics()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._failure: BaseException | None = None

    def run(self, cycles: int | None = None) -> None:
        """Send `cycles` SYNCs in this thread, or until `request_stop`."""
        send, on_cycle, wait, count = self.send, self.on_cycle, self.pacing.wait, self.statistics.count
        real_time = isinstance(self.pacing, RealTime)
        self._stop.clear()
        self.pacing.start(self.period)
        last = None if cycles is None else self.cycle + cycles
        while not self._stop.is_set() and self.cycle != last:
            cycle = self.cycle + 1
            count(wait(cycle))
            send(SYNC_ID, b"")
            self.cycle = cycle
            if on_cycle is not None:
                began = time.monotonic() if real_time else 0.0
                on_cycle(cycle)
                if real_time and time.monotonic() - began > self.period:
                    self.statistics.slow_callbacks += 1
            self.statistics.missed = self.pacing.missed

    def request_stop(self) -> None:
        """Let `run` return after the present cycle; may be called from any thread and from `on_cycle`."""
        self._stop.set()

    def start(self) -> None:
        """Send SYNCs from a thread until `stop`."""
        if self._thread is not None:
            raise RuntimeError("SYNC is being produced already")
        self._failure = None
        self._stop.clear()
        self._thread = threading.Thread(target=self._run_in_thread, name="sync", daemon=True)
        self._thread.start()

    def _run_in_thread(self) -> None:
        try:
            self.run()
        except BaseException as failure:
            self._failure = failure

    @property
    def running(self) -> bool:
        """Whether the thread is alive."""
        return self._thread is not None and self._thread.is_alive()

    def stop(self, timeout: float = 2.0) -> None:
        """End the thread; raises what `send` or `on_cycle` raised in it."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(timeout)
            self._thread = None
        if self._failure is not None:
            failure, self._failure = self._failure, None
            raise failure
