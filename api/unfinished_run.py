"""The run of a proof that came to no end anybody wrote down: who drove it was killed, or it was stopped before there was
anything to compare. Its recording says it, whoever drove it: the command line or a service."""

from dataclasses import dataclass
from pathlib import Path

from api.proof import first_recording, read_conclusion
from api.proof_drive import ORDINAL, Drive
from daq.experiment_folder import INCOMPLETE
from daq.recovery import RecordingState, being_written, recording_state, recover_recording
from identify.recording.errors import InputError

LEFT_OPEN = "the program that recorded it was killed, or the power failed"


@dataclass(frozen=True)
class UnfinishedRun:
    """The last run of a proof, of which no comparison is kept.

    drive     : which of the two it was
    complete  : whether the plan was driven to its end, and only the comparison is missing
    recording : its file inside the proof's folder; nothing of it is thrown away
    seconds   : s of samples that it holds, from the way to the start of the plan on
    reason    : why it ended, as far as the recording knows
    """

    drive: Drive
    complete: bool
    recording: str
    seconds: float
    reason: str

    @property
    def words(self) -> str:
        """What happened and what is kept, in two sentences."""
        run = f"The {ORDINAL[self.drive]} run"
        kept = f"{self.seconds:.1f} s of samples are kept in {self.recording}"
        if self.complete:
            return f"{run} came to its end, and the program that drove it ended before it compared the two. {kept}."
        compared = "; nothing was compared" if self.drive == "with" else ""
        return f"{run} did not come to its end: {self.reason}. {kept}{compared}."


def unfinished_run(folder: Path) -> UnfinishedRun | None:
    """Of the proof in `folder`; None where nothing was begun, where a run is being recorded, and where the last one came to its
    end or was compared. Raises InputError where its result or its experiment file was damaged."""
    path = _last(folder)
    if path is None or being_written(path):
        return None
    first, result = first_recording(folder), read_conclusion(folder)
    if path == first or (result is not None and result.recording_with == path.name):
        return None
    try:
        state = recording_state(path)
    except InputError as error:
        return UnfinishedRun(
            _drive(first), False, _inside(folder, path), 0.0, str(error).removeprefix(f"{path}: ")
        )
    reason = LEFT_OPEN if _left_open(state) else state.reason.rstrip(".")
    seconds = state.rows * state.cycle
    return UnfinishedRun(_drive(first), state.status == "complete", _inside(folder, path), seconds, reason)


def close_unfinished(folder: Path) -> None:
    """Close the recording that a killed run left open, before another is begun: every row is kept, any program can read it.

    Raises InputError where somebody is at work on it.
    """
    path = _last(folder)
    if path is None or being_written(path):
        return
    try:
        state = recording_state(path)
    except InputError:
        return  # damaged beyond reading: kept as it is
    if _left_open(state):
        recover_recording(path, "faulted", LEFT_OPEN)


def _last(folder: Path) -> Path | None:
    """The recording that was begun last: recordings of a proof are numbered on, wherever they stand."""
    recordings = [*folder.glob("session-*.h5"), *(folder / INCOMPLETE).glob("session-*.h5")]
    return max(recordings, key=lambda path: (len(path.name), path.name), default=None)


def _drive(first: Path | None) -> Drive:
    return "without" if first is None else "with"


def _inside(folder: Path, path: Path) -> str:
    return str(path.relative_to(folder))


def _left_open(state: RecordingState) -> bool:
    return state.status == "recording"
