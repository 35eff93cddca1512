"""The session that has a rig's bus: its steps, who checked the rig for it, and what happened so far."""

from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, Protocol

from api.service.bus_claims import BusClaim
from daq.session_events import Progress, SessionEvent, SessionState

if TYPE_CHECKING:
    from daq.live import LiveRows
    from daq.rig_check import RigCheck

MOVING = frozenset({SessionState.ARMED, SessionState.RUNNING})


class SessionSteps(Protocol):
    """The steps of a payload session and what can be seen of it, as `daq.session_workflow.PayloadSession` has them."""

    state: SessionState
    reason: str
    file: Path | None
    alarm: str
    rig_check: "RigCheck | None"

    @property
    def progress(self) -> Progress:
        """How far the motion is."""
        ...

    def check(self) -> "RigCheck":
        """Take the bus and check the rig, line by line."""
        ...

    def confirm_payload(self, mass: float) -> None:
        """The mass as weighed, kg; InputError where it is not the payload's."""
        ...

    def arm(self) -> None:
        """Start recorder and monitors; nothing moves."""
        ...

    def start(self) -> None:
        """Let the robot move; returns at once."""
        ...

    def stop(self, reason: str = ...) -> None:
        """Stop, from any thread and at any time; harmless when repeated."""
        ...

    def wait(self, timeout: float | None = None) -> SessionState:
        """Wait for the end, s at most; the state then."""
        ...

    def live(self, seconds: float) -> "LiveRows":
        """The rows of the last seconds, SI units."""
        ...

    def close(self) -> None:
        """End the processes and remove the ring; stops first where it must."""
        ...


@dataclass
class ActiveSession:
    """The session that has a rig's bus, or the last one that had it.

    rig, experiment, id : whose session it is
    experiment_name     : by which people know the experiment
    payload_session     : its steps
    user                : who checked the rig for it
    confirmed_in        : the operator's tenure in which the payload was confirmed (`RigOperators.tenure`)
    claim               : its claim on the bus, given back when the session has ended
    events              : what happened so far, in an operator's words
    """

    rig: str
    experiment: str
    experiment_name: str
    id: str
    payload_session: SessionSteps
    user: str
    confirmed_in: int | None = None
    claim: BusClaim | None = None
    events: list[SessionEvent] = field(default_factory=list)
    storing: Lock = field(default_factory=Lock)

    @property
    def state(self) -> SessionState:
        """Where it stands."""
        return self.payload_session.state

    @property
    def moves(self) -> bool:
        """Whether the robot moves, or will at the next step."""
        return self.state in MOVING

    @property
    def refusal(self) -> str:
        """For somebody else who wants the bus."""
        return f"The session {self.id} of {self.experiment_name} is using this rig; finish or discard it."

    def close(self) -> None:
        """Stop it if need be, let its processes end, and give the bus back."""
        self.payload_session.close()
        if self.claim is not None:
            self.claim.release()


def open_payload_session(*arguments: Any, **named: Any) -> SessionSteps:
    """A `daq.session_workflow.PayloadSession`; its buses are loaded only when a session needs them."""
    from daq.session_workflow import PayloadSession

    return PayloadSession(*arguments, **named)
