"""States of the service × phases of a session, each stopped by page, token and terminal: a process of its own, in real time.

The states are those of `make attack`. Asked of every cell: from the stop on, the axis rests within 0.6 s, as the samples in
shared memory say; the session ends, with a reason. Where nothing moves: nothing begins to, and the service goes on afterwards.
"""

import contextlib
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import httpx
import numpy as np

from api.commands.stop import stop
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.trapezoid import Move
from tests.attack.stand import (
    AT_REST,
    ATTEMPTS,
    Axis,
    Stand,
    comes_to_rest,
    long_plan,
    running_service,
    wait_until,
)
from tests.attack.states import STATES, State, half_requests
from tests.attack.ways import Way, by_page, by_token

SERVICE_PHASES = ("before", "checked", "armed", "slow", "fast", "stopping", "identifying")
SERVICE_STATES = tuple(state for state in STATES if state is not half_requests)
"""half-sent requests take nothing away that silent connections do not"""


def by_terminals_order(stand: Stand) -> Callable[[], object]:
    """What `coulomb stop` does, without the time in which its program is loaded; that is for `make attack`."""
    return lambda: stop("bench", stand.data)


SERVICE_WAYS: dict[str, Way] = {"page": by_page, "token": by_token, "terminal": by_terminals_order}
LONGEST = 0.6
"""s from the stop until the axis rests"""
SPEEDS = {"slow": 0.05, "fast": 0.3, "stopping": 0.3}
"""rad/s at least, when the stop comes"""
STEPS = ("check", "weigh", "confirm", "arm", "start")


def slow_plan() -> ExcitationPlan:
    """Back and forth at 0.1 rad/s."""
    moves = tuple(Move(to=(end,), duration=2.2, ramp=0.4) for end in (0.5, 0.3))
    return ExcitationPlan(joints=("j3",), start=(0.3,), phases=moves * 27, name="slow")


def short_plan() -> ExcitationPlan:
    """Over soon, and identified then."""
    moves = tuple(Move(to=(end,), duration=1.2, ramp=0.4) for end in (0.6, 0.3))
    return ExcitationPlan(joints=("j3",), start=(0.3,), phases=moves, name="short")


@dataclass(frozen=True)
class ServiceCell:
    """What became of one state in one phase.

    took : s until rest, for each way where each has a motion of its own; none where nothing moves
    """

    state: str
    phase: str
    took: tuple[float, ...]
    failures: tuple[str, ...]

    @property
    def words(self) -> str:
        """For the table."""
        if self.failures:
            return f"**fails**: {'; '.join(self.failures)}"
        if not self.took or self.phase == "armed":
            return "nothing moves"
        return " / ".join(f"{seconds:.2f}" for seconds in self.took) + " s"


def service_cells(state: State, phases: list[str]) -> Iterator[ServiceCell]:
    """Drive the state through these phases, on one service."""
    with tempfile.TemporaryDirectory() as folder:
        plans = (long_plan(), slow_plan(), short_plan())
        with running_service(Path(folder), plans=plans) as stand:
            # A rig that nothing has used is none that can be stopped.
            armed = _take(stand, "long", "arm")
            stand.stop()
            stand.ended(armed)
            for phase in phases:
                yield _cell(stand, state, phase)


def _cell(stand: Stand, state: State, phase: str) -> ServiceCell:
    name = state.__name__.replace("_", " ")
    try:
        if phase in ("before", "checked", "identifying"):
            return ServiceCell(name, phase, (), tuple(_at_rest(stand, state, phase)))
        if phase in ("armed", "stopping"):
            ways = {"all": lambda stand: _together([way(stand) for way in SERVICE_WAYS.values()])}
        else:
            ways = SERVICE_WAYS
        took, failures = [], []
        for label, way in ways.items():
            rest, said = _stopped(stand, state, phase, way)
            took.append(rest)
            failures += [f"{label}: {each}" for each in said]
        return ServiceCell(name, phase, tuple(took), tuple(failures))
    except (AssertionError, httpx.HTTPError) as error:
        return ServiceCell(name, phase, (), (f"{type(error).__name__}: {error}",))


def _together(presses: list[Callable[[], object]]) -> Callable[[], object]:
    """All of them at the same time, so that none waits for another's answer."""

    def press() -> None:
        with ThreadPoolExecutor(len(presses)) as pool:
            for each in [pool.submit(press) for press in presses]:
                each.result()

    return press


def _take(stand: Stand, plan: str, upto: str | None) -> str:
    """A new session, taken to that step; its address."""
    session = stand.new_session(plan)
    if upto is not None:
        stand.take(session, *STEPS[: STEPS.index(upto) + 1])
    return session


def _at_rest(stand: Stand, state: State, phase: str) -> list[str]:
    """Stops while nothing moves."""
    upto = {"before": None, "checked": "check", "identifying": "start"}[phase]
    session = _take(stand, "short" if phase == "identifying" else "long", upto)
    if phase == "identifying" and (ended := stand.ended(session))["state"] not in ("done", "complete"):
        return [f"the session was not driven to its end: {ended['reason']}"]
    presses = [way(stand) for way in SERVICE_WAYS.values()]
    with state(stand):
        for press in presses:
            press()
    moving = stand.session(session)["state"]
    stand.stop()
    if phase != "identifying":
        stand.discard(session)
    return [f"the session is {moving}"] if moving in ("armed", "running") else []


def _stopped(stand: Stand, state: State, phase: str, way: Way) -> tuple[float, list[str]]:
    """One session that is stopped in this way; s until rest, and what does not hold.

    A motion that ends before it is stopped, because this computer was held up, is begun once more.
    """
    for _ in range(ATTEMPTS):
        session = _take(stand, "slow" if phase == "slow" else "long", "arm" if phase == "armed" else "start")
        with stand.watched() as axis:
            press = way(stand)
            with state(stand):
                begun = _moves(axis, phase)
                pressed = time.monotonic()
                if phase == "stopping":
                    stand.stop()
                press()
                comes_to_rest(axis, timeout=20)
                took = axis.rest_after(pressed) if phase != "armed" else _stays(axis)
            ended = stand.ended(session)
        if not begun:
            continue
        failures = [] if took <= LONGEST else [f"{took:.2f} s"]
        if "stop" not in ended["reason"]:
            failures.append(f"{ended['state']}: {ended['reason']}")
        return took, failures
    raise AssertionError("this computer has too much else to do for a motion in real time")


def _moves(axis: Axis, phase: str) -> bool:
    """Wait until the axis is as the phase wants it; False if it does not come to be."""
    if phase == "armed":
        return True
    with contextlib.suppress(AssertionError):
        wait_until(lambda: len(axis.rows) > 20 and axis.speed_at(axis.rows[-1][0]) > SPEEDS[phase], 20)
        return True
    return False


def _stays(axis: Axis) -> float:
    """0 where an axis that was only armed stayed where it was; raises AssertionError where it moved."""
    positions = np.array(axis.rows)[:, 1]
    assert np.ptp(positions) < AT_REST, f"the armed axis moved by {np.ptp(positions):.4f} rad"
    return 0.0
