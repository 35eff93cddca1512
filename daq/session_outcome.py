"""What became of a session when its motion had ended: its recording kept, rescued, listed in the experiment, or none."""

from dataclasses import dataclass
from pathlib import Path

from daq.experiment_folder import Role, admit, give_back
from daq.raw_log import raw_log_of
from daq.recovery import RecordingState, recording_state, recover_recording
from daq.ring_buffer import RingReader
from daq.safety import StopCause, StopReason
from daq.samples import SessionRows
from daq.session_events import SessionState, StepOutOfTurn
from daq.session_processes import ProcessDied
from drivers.errors import DriverError
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload

NOTHING_KEPT = (
    "no sample of the plan was recorded yet; the rig's check says how the drives are and what to do"
)
"""of a session that a fault ended so early"""


@dataclass(frozen=True)
class Recorded:
    """A complete session, for what runs after it."""

    experiment: Path
    file: Path
    payload: str


DRIVE_AGAIN = "only a run that was driven to its end is compared: drive it again"
"""of a run that is one of a pair"""


@dataclass(frozen=True)
class Outcome:
    """How a session ended.

    state    : done where its recording, all of the plan, is in the experiment
    sentence : why, and what is kept where, for the operator
    file     : the recording; None where nothing is kept
    """

    state: SessionState
    sentence: str
    file: Path | None


def outcome_of(
    reason: StopReason,
    experiment: Path,
    file: Path | None,
    payload: Payload,
    role: Role,
    ring: RingReader | None,
    admissible: bool = True,
) -> Outcome:
    """What became of a session whose processes have ended.

    reason : why the motion ended
    file   : claimed for the recording when the session was armed
    ring   : holds what a recorder that died has not written
    admissible : whether a recording that ended early may be listed in the experiment later; one of a pair that is compared is
        driven again instead
    """
    state = SessionState.ABORTED if reason.status == "aborted" else SessionState.FAULTED
    sentence = reason.words
    if file is None or not file.exists():
        if file is not None:
            give_back(file)
        return Outcome(state, sentence, None)
    try:
        recording = recording_state(file)
        if recording.status == "recording":
            recording = _rescue(file, reason, ring)
            state, sentence = SessionState.FAULTED, recording.reason
    except InputError as error:
        return Outcome(SessionState.FAULTED, f"{sentence}; the recording is damaged: {error}", file)
    if recording.rows == 0:
        # Leave no empty shells behind.
        file.unlink()
        raw_log_of(file).unlink(missing_ok=True)
        if state is SessionState.FAULTED:
            sentence = f"{sentence}; {NOTHING_KEPT}"
        return Outcome(state, sentence, None)
    if recording.status != "complete":
        # The recorder is the last to judge: it knows what came to disk, and what is to be said against it.
        kept = (
            f"{recording.reason}; {recording.rows} samples are kept in {file.parent.name}/{file.name}; "
            + (
                f"`coulomb recover {experiment}` lists them in the experiment if they may serve identification"
                if admissible
                else DRIVE_AGAIN
            )
        )
        return Outcome(state if recording.status == "aborted" else SessionState.FAULTED, kept, file)
    try:
        listed = admit(experiment, file, payload, role)
    except (InputError, OSError) as error:
        kept = (
            f"{sentence}; {recording.rows} samples, all of the plan, are in {file.parent.name}/{file.name}, but they could "
            f"not be listed: {error_in_words(error)}; "
            + (
                f"put that right, then `coulomb recover {experiment}` lists them"
                if admissible
                else DRIVE_AGAIN
            )
        )
        return Outcome(SessionState.FAULTED, kept, file)
    return Outcome(SessionState.DONE, f"{sentence}; {recording.rows} samples in {listed.name}", listed)


def _rescue(file: Path, reason: StopReason, ring: RingReader | None) -> RecordingState:
    """The recorder died: close its file, with the rows that it left in the ring."""
    left = None if ring is None else SessionRows().take(ring.latest(ring.capacity))
    sentence = (
        reason.words if reason.cause is StopCause.RECORDER else f"the recorder process died; {reason.words}"
    )
    return recover_recording(file, "faulted", sentence, left)


def error_in_words(error: BaseException) -> str:
    """An error for an operator: its own words where it was made for one, else what kind it is and where it says more."""
    if isinstance(error, (InputError, StepOutOfTurn, DriverError, ProcessDied)):
        return str(error)
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        return f"{where}{error.strerror or 'the system refused without a reason'}"
    return f"an error of the software ({type(error).__name__}: {str(error) or 'without words'}); please report it"
