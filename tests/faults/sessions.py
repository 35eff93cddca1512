"""Mischief to the files and the processes of whole sessions, recorder and experiment's folder with them.

Asked of every cell: the session ends, in words; what it says of its recording is so, and no row is missing between the first
and the last; the next session can be checked, or is told in one line what to do.
"""

import contextlib
import os
import shutil
import signal
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.trapezoid import Move
from daq.experiment_folder import open_experiment
from daq.raw_log import raw_log_of
from daq.recovery import recording_state
from daq.rig import Rig
from daq.session_events import SessionEvent, SessionState, StepOutOfTurn
from daq.session_workflow import PayloadSession
from identify.recording.errors import InputError
from tests.faults.bench import bench_rig

PATIENCE = 120.0
"""s of the wall clock until a session must have ended"""
EARLY, LATE = 0.15, 0.6
"""share of the plan, in its slow and in its fast part"""
SESSION_PHASES = ("before", "checked", "armed", "slow", "fast", "stopping", "identifying")
ODD = b"}{ not yaml ]["


def plan_within_limits() -> ExcitationPlan:
    """Slow moves to and fro, then fast ones. Both last longer in simulated time than this process takes to hear of them: it is
    told of the progress by the clock, and an idle machine is through a plan of a few seconds before."""
    slow = [Move(to=(end,), duration=1.5, ramp=0.3) for end in (0.5, 0.35)]
    fast = [Move(to=(end,), duration=1.6, ramp=0.5) for end in (1.2, 0.5)]
    moves = (*slow * 4, slow[0], *fast * 5)
    return ExcitationPlan(joints=("j3",), start=(0.35,), phases=moves)


@dataclass(frozen=True)
class Place:
    """What a mischief finds."""

    session: PayloadSession
    folder: Path

    @property
    def recording(self) -> Path | None:
        """The file that is written now, or was."""
        return self.session.file


def _delete_recording(place: Place) -> None:
    if place.recording is not None:
        place.recording.unlink(missing_ok=True)


def _delete_raw_log(place: Place) -> None:
    if place.recording is not None:
        raw_log_of(place.recording).unlink(missing_ok=True)


def _delete_incomplete(place: Place) -> None:
    shutil.rmtree(place.folder / "incomplete", ignore_errors=True)


def _delete_folder(place: Place) -> None:
    shutil.rmtree(place.folder, ignore_errors=True)


def _delete_declaration(place: Place) -> None:
    (place.folder / "experiment.yaml").unlink(missing_ok=True)


def _break_declaration(place: Place) -> None:
    if place.folder.is_dir():
        (place.folder / "experiment.yaml").write_bytes(ODD)


def _other_robot(place: Place) -> None:
    declaration = place.folder / "experiment.yaml"
    if declaration.is_file():
        declaration.write_text(declaration.read_text().replace("j3", "elbow"))


def _odd_recording_beside(place: Place) -> None:
    beside = place.folder / "incomplete"
    with contextlib.suppress(OSError):
        beside.mkdir(parents=True, exist_ok=True)
        (beside / "session-77.h5").write_bytes(b"no HDF5" * 100)


def _signal(process: str, *signals: signal.Signals, pause: float = 0.0) -> Callable[[Place], None]:
    def send(place: Place) -> None:
        processes = place.session.processes
        found = None if processes is None else getattr(processes, process)
        for number, each in enumerate(signals):
            if number:
                threading.Event().wait(pause)
            if found is not None and found.poll() is None:
                os.kill(found.pid, each)

    return send


def _kill_both(place: Place) -> None:
    _signal("recorder", signal.SIGKILL)(place)
    _signal("acquisition", signal.SIGKILL)(place)


def _close(place: Place) -> None:
    threading.Thread(target=place.session.close).start()


@dataclass(frozen=True)
class SessionFault:
    """One mischief to a session."""

    name: str
    kind: str
    mischief: Callable[[Place], None]


STOP, GO_ON = signal.SIGSTOP, signal.SIGCONT
SESSION_FAULTS = (
    SessionFault("recording deleted", "file", _delete_recording),
    SessionFault("raw log deleted", "file", _delete_raw_log),
    SessionFault("`incomplete` deleted", "file", _delete_incomplete),
    SessionFault("experiment's folder deleted", "file", _delete_folder),
    SessionFault("experiment.yaml deleted", "file", _delete_declaration),
    SessionFault("experiment.yaml broken", "file", _break_declaration),
    SessionFault("experiment.yaml of another robot", "file", _other_robot),
    SessionFault("an odd recording beside", "file", _odd_recording_beside),
    SessionFault("recorder killed", "process", _signal("recorder", signal.SIGKILL)),
    SessionFault("recorder held up 0.5 s", "process", _signal("recorder", STOP, GO_ON, pause=0.5)),
    SessionFault("recorder told to terminate", "process", _signal("recorder", signal.SIGTERM)),
    SessionFault("acquisition killed", "process", _signal("acquisition", signal.SIGKILL)),
    SessionFault("acquisition told to terminate", "process", _signal("acquisition", signal.SIGTERM)),
    SessionFault("acquisition and recorder killed", "process", _kill_both),
    SessionFault("session closed", "process", _close),
)


@dataclass(frozen=True)
class SessionCell:
    """What became of one mischief in one phase."""

    fault: SessionFault
    phase: str
    state: SessionState | None
    reason: str
    failures: tuple[str, ...]

    @property
    def words(self) -> str:
        """For the table."""
        if self.failures:
            return f"**fails**: {'; '.join(self.failures)}"
        return "refused" if self.state is None else self.state.value


def session_cell(fault: SessionFault, phase: str, folder: Path) -> SessionCell:
    """Drive one cell into a folder of its own."""
    rig, experiment = bench_rig(), folder / "experiment"
    place: Place | None = None
    done = threading.Event()
    failures: list[str] = []

    def act() -> None:
        if not done.is_set() and place is not None:
            done.set()
            try:
                fault.mischief(place)
            except Exception as error:  # a session goes on when who listens to its events fails
                failures.append(f"the mischief was not done: {error!r}")

    def hear(event: SessionEvent) -> None:
        if event.kind != "progress":
            return
        fraction = event.data["fraction"]
        if (phase == "slow" and fraction > EARLY) or (phase == "fast" and fraction > LATE):
            act()
        elif phase == "stopping" and fraction > LATE and not done.is_set() and place is not None:
            place.session.stop()
            act()

    session = PayloadSession(
        rig,
        experiment,
        plan_within_limits(),
        rig.payload("none"),
        "operator",
        on_event=hear,
        after_session=lambda _: act() if phase == "identifying" else None,
    )
    place = Place(session, experiment)
    with session:
        try:
            if phase == "before":
                open_experiment(experiment, rig)
                act()
            _take_steps(session, phase, act)
        except InputError as error:
            session.stop()
            return SessionCell(fault, phase, None, str(error), tuple(_next_is_not_blocked(rig, experiment)))
        except StepOutOfTurn:
            pass  # said by the session's own reason
        if not session.wait(PATIENCE).ended:
            failures.append("the session did not end")
    if not done.is_set():
        failures.append("the phase was not reached")
    if not session.reason:
        failures.append("no reason is given")
    failures += _what_is_said_is_so(session)
    failures += _next_is_not_blocked(rig, experiment)
    return SessionCell(fault, phase, session.state, session.reason, tuple(failures))


def _take_steps(session: PayloadSession, phase: str, act: Callable[[], None]) -> None:
    session.check()
    if phase == "checked":
        act()
    session.confirm_payload(0.0)
    session.arm()
    if phase == "armed":
        act()
    session.start()


def _what_is_said_is_so(session: PayloadSession) -> list[str]:
    """Whether the recording is as the session says."""
    file = session.file
    if file is None or not file.exists():
        # A recording that somebody deleted after it was listed is theirs; else it must have been said.
        return []
    try:
        found = recording_state(file)
    except InputError as error:
        return (
            []
            if "damaged" in session.reason
            else [f"a damaged recording that is not said to be one: {error}"]
        )
    failures = []
    # Complete and not listed, because of the experiment's declaration, is said, with what to do.
    done = session.state is SessionState.DONE or "could not be listed" in session.reason
    if (found.status == "complete") != done:
        failures.append(f"the session is {session.state.value}, its file says {found.status}")
    with h5py.File(file) as recording:
        cycle = recording["cycle"][:]
    # Between the plan's end and a stop that came after it the axes are held, which is not recorded.
    gaps = np.flatnonzero(np.diff(cycle) != 1) + 1
    if any(gap != session.progress.cycles for gap in gaps):
        failures.append("rows are missing in the middle")
    return failures


def _next_is_not_blocked(rig: Rig, experiment: Path) -> list[str]:
    """Whether the next session can be checked, or is refused in one line that names a file."""
    try:
        with PayloadSession(rig, experiment, plan_within_limits(), rig.payload("none"), "operator") as after:
            check = after.check()
            return [] if check.ok else [f"the next session is blocked: {check.problems}"]
    except (InputError, StepOutOfTurn) as error:
        named = "experiment.yaml" in str(error) or str(experiment) in str(error)
        return [] if named and "\n" not in str(error) else [f"the next session is blocked: {error}"]
