"""What a session's state is called, in one place for every page, and what became of a session that is over."""

from dataclasses import dataclass
from urllib.parse import urlencode

from api.pages.layout import experiment_link, session_link
from api.pages.rendering import PREFIX
from api.pages.sentence import sentence
from api.service.active_session import ActiveSession
from api.service.database import SessionRow
from api.service.proof_drives import drive_of_proof
from api.service.service import Service
from api.service.unlisted_recordings import RECORDING
from daq.session_events import SessionState
from identify.recording.errors import InputError


@dataclass(frozen=True)
class StateWords:
    """kind : colour and sign of the state; short : in the bar of every page; long : where the session itself is shown"""

    kind: str
    short: str
    long: str


STATES: dict[SessionState, StateWords] = {
    SessionState.NEW: StateWords("good", "Nothing moves", "Being prepared"),
    SessionState.CHECKED: StateWords("good", "Nothing moves", "Checked; nothing is powered"),
    SessionState.CONFIRMED: StateWords("good", "Nothing moves", "Payload confirmed; nothing is powered"),
    SessionState.ARMED: StateWords("warn", "Armed", "Armed: the next step moves the robot"),
    SessionState.RUNNING: StateWords("warn", "Moving", "The robot moves"),
    SessionState.DONE: StateWords("good", "Nothing moves", "Done"),
    SessionState.ABORTED: StateWords("warn", "Nothing moves", "Stopped"),
    SessionState.FAULTED: StateWords("fault", "Nothing moves", "Ended by a fault"),
}
NO_SESSION = StateWords("idle", "Nothing moves", "Nothing moves")


@dataclass(frozen=True)
class NextStep:
    """A button: what it says and where it leads."""

    words: str
    link: str


@dataclass(frozen=True)
class Outcome:
    """What happened, in one sentence, and what to do next.

    title : a few words, such as `Measured.`
    todo  : what a person must do before the next step; empty where nothing
    """

    kind: str
    title: str
    words: str
    todo: str
    step: NextStep
    other: NextStep | None = None


def outcome(service: Service, row: SessionRow) -> Outcome | None:
    """What became of a session, also after the service was started again; None while it is armed or moves."""
    active = _active(service, row)
    if drive_of_proof(row) is not None:
        return _of_drive(service, row, active)
    state = active.state.value if active is not None else row.state
    reason = for_a_page((service.sessions.reason(active) if active is not None else row.reason) or "")
    name = f"{row.id} of {service.experiments.row(row.experiment).name}"
    if (
        active is None and reason
    ):  # after the service was started again nothing else says which session it was
        reason = f"{name}: {reason}"
    again = NextStep("Prepare it again", _prepare(row, row.payload.name))
    kept = "What was measured is kept." if row.file and "are kept" not in reason else ""
    measured = (
        NextStep("What was measured", experiment_link(row.experiment, "sessions")) if row.file else None
    )
    if state in (SessionState.ARMED, SessionState.RUNNING) and active is not None:
        return None
    if state == SessionState.DONE:
        ending = reason or f"The plan ran to its end with the payload {row.payload.name}"
        return _measured(service, row, sentence(ending))
    if state == SessionState.ABORTED:
        return Outcome("warn", "The session was stopped.", sentence(reason), kept, again, measured)
    if state == SessionState.FAULTED:
        todo = f"{kept} Remove the cause at the machine, then check the rig again.".strip()
        return Outcome("fault", "A fault ended the session.", sentence(reason), todo, again, measured)
    if row.state == RECORDING:
        cut_off = f"The service ended while {name} was recorded. What was measured until then is kept."
        recover = NextStep("Recover the recording", experiment_link(row.experiment, "sessions"))
        return Outcome("warn", "The session was cut off.", cut_off, "", recover)
    if row.file is not None:
        return _measured(service, row, f"{name} is in the experiment.")
    go_on = NextStep("Continue the session", session_link(row.experiment, row.id))
    if active is None and row.state != SessionState.NEW:
        cut_off = f"The service was restarted after {name} was checked. Check the rig again."
        return Outcome("warn", "Nothing has moved.", cut_off, "", go_on)
    return Outcome("good", "Nothing has moved.", f"{name} is being prepared.", "", go_on)


def _of_drive(service: Service, row: SessionRow, active: ActiveSession | None) -> Outcome | None:
    """What became of a drive of a proof: whatever it was, it goes on where the proof is."""
    drive = drive_of_proof(row)
    assert drive is not None
    number, which = drive
    state = active.state if active is not None else SessionState(row.state)
    reason = sentence(
        for_a_page((service.sessions.reason(active) if active is not None else row.reason) or "")
    )
    back = NextStep("Continue the proof", experiment_link(row.experiment, f"proofs/{number}"))
    if state is SessionState.DONE:
        todo = "" if which == "with" else "Next: the same plan with the model's feedforward torque."
        if which == "with":
            back = NextStep("See the comparison", back.link)
        return Outcome("good", "Complete.", reason, todo, back)
    if state.ended:
        kind = "warn" if state is SessionState.ABORTED else "fault"
        title = "The run was stopped." if state is SessionState.ABORTED else "A fault ended the run."
        return Outcome(kind, title, reason, "", back)
    if active is None and service.proofs.cut_off(row):
        unfinished = service.proofs.get(row.experiment, number).unfinished
        ending = "" if unfinished is None else unfinished.words
        todo = "Prepare this run again where the proof is."
        return Outcome("warn", "The service ended while this run was recorded.", ending, todo, back)
    if active is not None and active.moves:
        return None
    go_on = NextStep("Continue the run", session_link(row.experiment, row.id))
    return Outcome("good", "Nothing has moved.", f"A run of proof {number} is being prepared.", "", go_on)


def _measured(service: Service, row: SessionRow, ending: str) -> Outcome:
    """The next payload where one of the rig is not measured yet, else the result; the other one beside it."""
    result = NextStep("See the result", experiment_link(row.experiment, "model"))
    unmeasured = _unmeasured(service, row)
    if not unmeasured:
        another = NextStep("Another session", _prepare(row, row.payload.name))
        return Outcome("good", "Measured.", ending, "", result, another)
    following = NextStep(f"Next payload: {unmeasured[0]}", _prepare(row, unmeasured[0]))
    return Outcome("good", "Measured.", ending, "", following, result)


def _unmeasured(service: Service, row: SessionRow) -> list[str]:
    """Payloads of the rig that no session of the experiment was measured with."""
    try:
        declared = service.rigs.rig(row.rig or "").payloads if row.rig in service.rigs.files() else ()
    except InputError:
        return []
    measured = {
        each.payload.name for each in service.experiments.sessions(row.experiment) if each.file is not None
    }
    return [payload.name for payload in declared if payload.name not in measured | {row.payload.name}]


def _active(service: Service, row: SessionRow) -> ActiveSession | None:
    active = service.sessions.active(row.rig or "")
    ours = active is not None and (active.experiment, active.id) == (row.experiment, row.id)
    return active if ours else None


def _prepare(row: SessionRow, payload: str) -> str:
    chosen = {"rig": row.rig or "", "experiment": row.experiment, "payload": payload, "plan": row.plan or ""}
    return f"{PREFIX}/new-session?{urlencode({name: value for name, value in chosen.items() if value})}"


def for_a_page(reason: str) -> str:
    """A reason without what it advises for the command line: the page has its own way there."""
    return "; ".join(part for part in reason.split("; ") if "`coulomb " not in part)
