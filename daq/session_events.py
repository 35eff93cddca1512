"""The states of a payload session, the ways between them, and the events that tell of them."""

from dataclasses import dataclass, field
from datetime import UTC, datetime
from enum import StrEnum

from daq.json_object import JsonObject


class SessionState(StrEnum):
    """Where a payload session stands. It only ever moves forward; a stop leads to one of the last three."""

    NEW = "new"
    """nothing has been touched"""
    CHECKED = "checked"
    """the nodes are there, configured and homed; the plan is within the limits; nothing is powered"""
    CONFIRMED = "payload confirmed"
    """the operator has weighed and mounted the payload"""
    ARMED = "armed"
    """recorder and monitors run; the next step moves the robot"""
    RUNNING = "running"
    """the robot moves"""
    DONE = "done"
    """the plan ran to its end; the data are complete"""
    ABORTED = "aborted"
    """somebody stopped it; what was measured until then is kept"""
    FAULTED = "faulted"
    """a monitor or a drive stopped it; what was measured until then is kept"""

    @property
    def ended(self) -> bool:
        """Whether the session is over."""
        return self in (SessionState.DONE, SessionState.ABORTED, SessionState.FAULTED)


ENDS = frozenset({SessionState.ABORTED, SessionState.FAULTED})

TRANSITIONS: dict[SessionState, frozenset[SessionState]] = {
    SessionState.NEW: frozenset({SessionState.CHECKED}) | ENDS,
    SessionState.CHECKED: frozenset({SessionState.CONFIRMED}) | ENDS,
    SessionState.CONFIRMED: frozenset({SessionState.ARMED}) | ENDS,
    SessionState.ARMED: frozenset({SessionState.RUNNING}) | ENDS,
    SessionState.RUNNING: frozenset({SessionState.DONE}) | ENDS,
    SessionState.DONE: frozenset(),
    SessionState.ABORTED: frozenset(),
    SessionState.FAULTED: frozenset(),
}


class StepOutOfTurn(Exception):
    """A step was asked for that does not follow from the session's state; one sentence for the operator."""


@dataclass(frozen=True)
class SessionEvent:
    """Something that happened, for a screen, a log or a browser.

    kind : `state` (a new state), `progress` (data: cycle, cycles, fraction, elapsed in s), `remark`, or `alarm` (what a
        person must do now; empty words take it back)
    state : the session's state after the event
    words : one sentence for the operator
    """

    kind: str
    state: SessionState
    words: str
    data: JsonObject = field(default_factory=JsonObject)
    time: datetime = field(default_factory=lambda: datetime.now(UTC))

    def to_json(self) -> JsonObject:
        """Plain values; time in ISO 8601, UTC."""
        return {
            "kind": self.kind,
            "state": self.state.value,
            "words": self.words,
            "data": self.data,
            "time": self.time.isoformat(timespec="milliseconds"),
        }


@dataclass(frozen=True)
class Progress:
    """How far the plan has been driven."""

    cycle: int
    cycles: int
    elapsed: float
    """s of the rig's time"""
    first: int | None = None
    """SYNC of the plan's first row; None while that is not known"""

    @property
    def fraction(self) -> float:
        """0 to 1."""
        return self.cycle / self.cycles if self.cycles else 0.0
