"""Reads the running session's ring buffer and hands encoded blocks and the status to the rig's viewers."""

import asyncio
import logging
from collections.abc import Callable
from typing import TYPE_CHECKING

import anyio
import anyio.to_thread
import numpy as np
from numpy.typing import NDArray

from api.service.active_session import ActiveSession
from api.service.envelope import envelope
from api.service.expected_current import Expectation, ExpectedCurrent
from api.service.live import Broadcast, encode_block
from api.service.payload_sessions import PayloadSessions
from api.service.problems import Problem
from api.service.rig_documents import ActiveSessionView, BusFigures, LiveStatus, RigStatus, SessionEventView
from api.service.rig_operators import RigOperators
from identify.recording.errors import InputError

if TYPE_CHECKING:
    from daq.live import LiveRows

ROWS_OF_BLOCK = 200
"""Rows of a block at most: a simulated rig that runs faster than time would fill the line otherwise."""
WINDOW = 1.0
"""s of the rig's time looked at per block; longer than the pause between blocks, so that none is missed."""
_log = logging.getLogger(__name__)


class LiveFeed:
    """One producer for each rig that has viewers and a session; lives in the event loop.

    rate : blocks per second, Hz
    expected : what is expected of the drives in a session, by its experiment and id; None where nothing is
    """

    def __init__(
        self,
        operators: RigOperators,
        sessions: PayloadSessions,
        rate: float,
        expected: Callable[[str, str], ExpectedCurrent | None],
    ) -> None:
        self._operators = operators
        self._sessions = sessions
        self._pause = 1.0 / rate
        self._expected = expected
        self._broadcasts: dict[str, Broadcast] = {}
        self._producers: dict[str, asyncio.Task[None]] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._threads: anyio.CapacityLimiter | None = None

    def start(self) -> None:
        """Begin; called in the event loop."""
        self._loop = asyncio.get_running_loop()
        self._threads = anyio.CapacityLimiter(2)
        self._sessions.listen(self._changed)

    async def close(self) -> None:
        """End all producers."""
        self._sessions.unlisten(self._changed)
        for task in self._producers.values():
            task.cancel()
        await asyncio.gather(*self._producers.values(), return_exceptions=True)

    def broadcast(self, rig: str) -> Broadcast:
        """The viewers of a rig; a producer runs as long as there is something to see."""
        broadcast = self._broadcasts.setdefault(rig, Broadcast())
        self._ensure_producer(rig)
        return broadcast

    def tell(self, rig: str) -> None:
        """Send the status anew, such as after somebody took the rig; from any thread."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._send_status, rig)

    def status(self, rig: str) -> RigStatus:
        """What the live page says about a rig, in an operator's words and SI units."""
        active = self._sessions.active(rig)
        return RigStatus(
            rig=rig,
            operator=self._operators.operator(rig),
            onlookers=self._operators.onlookers(rig),
            session=None if active is None else self._session(active),
        )

    def _session(self, active: ActiveSession) -> ActiveSessionView:
        progress = active.payload_session.progress
        return ActiveSessionView(
            experiment=active.experiment,
            experiment_name=active.experiment_name,
            id=active.id,
            state=active.state.value,
            reason=self._sessions.reason(active),
            alarm=active.payload_session.alarm,
            fraction=progress.fraction,
            elapsed=progress.elapsed,
            events=[SessionEventView.model_validate(event.to_json()) for event in active.events[-20:]],
        )

    def _live_status(self, rig: str, reader: "BlockReader") -> str:
        return LiveStatus(**dict(self.status(rig)), figures=reader.figures()).model_dump_json()

    def _changed(self, active: ActiveSession) -> None:
        """An event of a session, in that session's thread."""
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._announce, active.rig)

    def _announce(self, rig: str) -> None:
        self._send_status(rig)
        self._ensure_producer(rig)

    def _send_status(self, rig: str) -> None:
        if rig in self._broadcasts:
            self._broadcasts[rig].send_status(self.status(rig).model_dump_json())

    def _ensure_producer(self, rig: str) -> None:
        running = self._producers.get(rig)
        active = self._sessions.active(rig)
        if (
            rig in self._broadcasts
            and (running is None or running.done())
            and active
            and not active.state.ended
        ):
            self._producers[rig] = asyncio.create_task(self._produce(rig, active))

    async def _produce(self, rig: str, active: ActiveSession) -> None:
        broadcast = self._broadcasts[rig]
        expectation = await anyio.to_thread.run_sync(self._expectation, active)
        reader = BlockReader(active, expectation)
        try:
            while not active.state.ended:
                if broadcast.viewers:
                    block = await anyio.to_thread.run_sync(reader.read, limiter=self._threads)
                    if block is not None:
                        broadcast.send_block(block)
                    broadcast.send_status(self._live_status(rig, reader))
                await asyncio.sleep(self._pause)
        except Exception:
            _log.exception("live view of %s ended", rig)
        broadcast.send_status(self._live_status(rig, reader))

    def _expectation(self, active: ActiveSession) -> Expectation | None:
        """What is expected of the drives. The motion is watched without it where it cannot be said."""
        try:
            return self._expected(active.experiment, active.id)
        except (InputError, Problem) as error:
            _log.warning("live view of %s: no prediction: %s", active.rig, error)
            return None


class BlockReader:
    """Takes what is new from the session's live rows and encodes it once; counts what was lost."""

    def __init__(self, active: ActiveSession, expectation: Expectation | None = None) -> None:
        self._session = active.payload_session
        self._expectation = expectation
        self._last = -np.inf
        self._steps: list[float] = []
        self._missing = 0
        self._rows = 0

    def read(self) -> bytes | None:
        """The rows since the last call as a block, or None if there are none."""
        live = self._session.live(WINDOW)
        new = live.time > self._last
        if not new.any():
            return None
        time = live.time[new]
        self._count(time, np.asarray(live.valid)[new])
        self._last = float(time[-1])
        axes = live.position.shape[1]
        signals = {f"position {axis}": live.position[new, axis] for axis in range(axes)}
        signals |= {f"command {axis}": live.command[new, axis] for axis in range(axes)}
        setpoint = self._setpoint(live, new)
        for name, group in (
            ("following error", setpoint - live.position[new]),
            ("setpoint", setpoint),
            ("predicted", self._predicted(live, new)),
            ("temperature", live.temperature[new]),
        ):
            signals |= {f"{name} {axis}": group[:, axis] for axis in range(axes)}
        origin, values = envelope(time, signals, ROWS_OF_BLOCK)
        return encode_block(origin, values, axes)

    def _setpoint(self, live: "LiveRows", new: NDArray[np.bool_]) -> NDArray[np.float64]:
        """(M, n) of the new rows; NaN at standstill and while the axes brake, where the drives follow nothing."""
        from daq.samples import Phase  # buses are loaded only when a session needs them

        follows = np.isin(live.phase[new], (Phase.APPROACH, Phase.PLAN))
        return np.where(follows[:, None], live.setpoint[new], np.nan)

    def _predicted(self, live: "LiveRows", new: NDArray[np.bool_]) -> NDArray[np.float64]:
        """(M, n) A for the new rows; NaN where the plan is not driven, or nothing is predicted."""
        from daq.samples import Phase

        predicted = np.full((int(new.sum()), live.position.shape[1]), np.nan)
        planned, first = live.phase[new] == Phase.PLAN, self._session.progress.first
        if self._expectation is None or first is None or not planned.any():
            return predicted
        place = (live.cycle[new][planned] - first).astype(float)
        # A model is asked at no more instants than are drawn; between them its torque is a straight line.
        asked = np.unique(place[:: max(1, len(place) // ROWS_OF_BLOCK)])
        current = self._expectation.at(asked)
        for axis in range(current.shape[1]):
            predicted[planned, axis] = np.interp(place, asked, current[:, axis])
        return predicted

    def _count(self, time: np.ndarray, valid: np.ndarray) -> None:
        self._rows += len(time)
        self._missing += int(((valid & 0x03) != 0x03).sum())
        self._steps = [*self._steps, *np.diff(time).tolist()][-5000:]

    def figures(self) -> BusFigures:
        """Rows seen, values that did not come, and the spread of the SYNC period in s over the last rows."""
        steps = np.array(self._steps)
        return BusFigures(
            rows=self._rows,
            missing=self._missing,
            sync_period=float(steps.mean()) if len(steps) else None,
            sync_jitter=float(steps.std()) if len(steps) else None,
        )
