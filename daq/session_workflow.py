"""The payload session: rig checked, payload weighed, armed, started, watched, ended; each step in its turn.

This is the side that holds the stop button. The bus belongs to the acquisition process, the files to the
recorder; both go on to a safe end without us.
"""

import json
import secrets
import threading
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Self

from daq.acquisition import AcquisitionMessage, AcquisitionOrder
from daq.disk_space import require_space
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.plan_limits import require_within_limits
from daq.experiment_folder import (
    Role,
    claim_recording,
    discard_unused,
    next_recording,
    open_experiment,
)
from daq.files_as_read import FilesAsRead
from daq.live import LiveRows, LiveView
from daq.plan_setpoints import plan_counts
from daq.recorder import RecorderOrder
from daq.recording_file import SessionDescription
from daq.rig import Rig
from daq.rig_check import RigCheck
from daq.rig_drives import take_power
from daq.ring_buffer import RingReader, remove_abandoned_rings
from daq.safety import StopCause, StopReason
from daq.session_events import TRANSITIONS, Progress, SessionEvent, SessionState, StepOutOfTurn
from daq.session_outcome import Recorded, error_in_words, outcome_of
from daq.session_processes import SessionProcesses
from daq.torque_offset import SentAhead
from daq.weighed_mass import require_mass
from drivers.as_found import HeldSettings
from identify.recording.controller_file import ControllerFile
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload

_BEAT = 0.2
"""s between two signs of life to the acquisition process"""
_CHECK_TIMEOUT = 60.0
"""s for the acquisition process to start and to look at every drive"""
_CLOSE_TIMEOUT = 30.0
"""s for processes to end by themselves"""


class PayloadSession:
    """One session with one payload on one rig, recorded into an experiment's folder.

    experiment : the folder; made when it is not there
    plan : checked against the rig's limits at once
    on_event : called with every SessionEvent from the session's own thread
    after_session : called likewise with a Recorded, before the state becomes `done`
    sign_of_life : asked before every sign of life to the acquisition: whether a stop would be heard now; while it is not, the
        motion ends as if this process had died
    provisional : whether the experiment is still being put together: once its folder is removed, nobody wants the recording
    admissible : whether a recording that ended early may be listed in the experiment later (`outcome_of`)
    made_from : the files that rig and plan were read from; once one of them is another the session ends before anything moves

    Raises InputError when plan, payload or folder do not fit the rig.
    """

    def __init__(
        self,
        rig: Rig,
        experiment: Path,
        plan: ExcitationPlan,
        payload: Payload,
        operator: str,
        on_event: Callable[[SessionEvent], None] | None = None,
        *,
        role: Role = "identification",
        after_session: Callable[[Recorded], None] | None = None,
        seed: int | None = None,
        sign_of_life: Callable[[], bool] = lambda: True,
        ahead: SentAhead | None = None,
        provisional: bool = False,
        admissible: bool = True,
        made_from: FilesAsRead | None = None,
    ) -> None:
        require_within_limits(plan, rig)
        self.rig = rig
        self.experiment = Path(experiment)
        self.plan = plan
        self.payload = payload
        self.operator = operator
        self.role: Role = role
        self.state = SessionState.NEW
        self.reason = ""
        self.file: Path | None = None
        self.rig_check: RigCheck | None = None
        self.weighed_mass: float | None = None
        self._on_event = on_event or _unheard
        self._after_session = after_session
        self._seed = seed
        self._provisional = provisional
        self._admissible = admissible
        self._made_from = made_from or FilesAsRead()
        self._could_stop_now = sign_of_life
        self._counts = plan_counts(rig, plan)
        if ahead is not None and ahead.counts.shape != self._counts.shape:
            raise InputError(
                f"feedforward torque: {self._counts.shape} values are needed, a row for each cycle of the plan; there are"
                f" {ahead.counts.shape}"
            )
        self._ahead = ahead
        self._progress = Progress(0, len(self._counts), 0.0)
        self._ring = f"{rig.name[:24]}-{secrets.token_hex(6)}"
        self._clock_source = ""
        self._controllers: ControllerFile | None = None
        self._held_before: Mapping[int, HeldSettings] = {}
        self.remarks: tuple[str, ...] = ()
        """what is to be known of this computer and of the drives' set-up, once the rig was checked"""
        self._changed = threading.Condition()
        self._closing = threading.Event()
        self._closer = threading.Lock()
        self.processes: SessionProcesses | None = None
        """once the rig was checked"""
        self._threads: list[threading.Thread] = []
        self._ended: AcquisitionMessage | None = None
        self._live: LiveView | None = None
        self._made_experiment = False
        self._stepping = threading.Lock()
        self._failed = ""  # what went wrong in a step of ours
        self._rows: RingReader | None = None
        self.alarm = ""
        """what a person must do now, because an axis may have power or move; empty where nothing is known of that"""

    # ---- the steps ----

    @contextmanager
    def _step(self, needed: SessionState, step: str) -> Generator[None]:
        """One step at a time, in its turn; what fails in it ends the session, in words.

        Raises StepOutOfTurn, and then nothing happened.
        """
        if not self._stepping.acquire(blocking=False):
            raise StepOutOfTurn(f"cannot {step}: another step of this session is under way; wait for it")
        try:
            self._in_turn(needed, step)
            try:
                yield
            except (StepOutOfTurn, InputError):
                raise
            except Exception as error:
                self._fail(f"cannot {step}: {error_in_words(error)}")
                raise StepOutOfTurn(f"cannot {step}: {self.reason}") from error
        finally:
            self._stepping.release()

    def _fail(self, reason: str) -> None:
        """A step went wrong: the session ends with these words, and so do its processes."""
        self._failed = reason
        self.stop(reason)
        self.wait(_CLOSE_TIMEOUT)
        self._end(SessionState.FAULTED, reason)

    def check(self) -> RigCheck:
        """Take the bus and look at every drive. A rig that fails the check ends the session as faulted.

        Raises InputError where the experiment's folder belongs to another robot or its disk is too full, StepOutOfTurn.
        """
        with self._step(SessionState.NEW, "check the rig"):
            remove_abandoned_rings()
            self._made_experiment = open_experiment(self.experiment, self.rig)
            require_space(self.rig, self.experiment, self.plan.duration)
            self._launch()
            self._await(
                lambda: self.rig_check is not None,
                _CHECK_TIMEOUT,
                "the rig was not checked in time; is the bus there?",
            )
            if self.rig_check is None:
                raise StepOutOfTurn(f"the rig could not be checked: {self.reason}")
            self._require_files_as_read("check the rig")
            return self.rig_check

    def _require_files_as_read(self, step: str) -> None:
        """The session stands on what its files said when they were read, and other processes read them again: where one is
        another by now it ends, and nothing moves.

        Raises StepOutOfTurn.
        """
        change = self._made_from.change()
        if change and not self.state.ended:
            reason = f"{change} since it was read for this session; check the rig again"
            self.stop(reason)
            self.wait(_CLOSE_TIMEOUT)
            raise StepOutOfTurn(f"cannot {step}: {reason}")

    def _launch(self) -> None:
        """Start the acquisition process and the recorder, and listen to the one."""
        self.processes = SessionProcesses()
        self.processes.start()
        seed = self._seed if self._seed is not None else _seed_of(next_recording(self.experiment))
        self.processes.acquire(
            AcquisitionOrder(
                self.rig,
                self.payload,
                self._counts,
                f"{self._ring}-rows",
                f"{self._ring}-frames",
                seed,
                self._ahead,
            )
        )
        for task in (self._listen, self._beat):
            thread = threading.Thread(target=task, name=f"session-{task.__name__}", daemon=True)
            self._threads.append(thread)
            thread.start()

    def confirm_payload(self, mass: float) -> None:
        """The payload is mounted and weighs `mass` kg, as the scale said.

        Raises InputError when that is not the payload's mass, StepOutOfTurn.
        """
        with self._step(SessionState.CHECKED, "confirm the payload"):
            require_mass(self.payload, mass)
            self.weighed_mass = mass
            self._enter(SessionState.CONFIRMED, f"payload {self.payload.name} confirmed, {mass:g} kg")

    def arm(self) -> None:
        """Open the recording and let monitors and SYNC run; the next step moves the robot.

        Raises StepOutOfTurn, also when arming failed; the session has then ended with its reason.
        """
        with self._step(SessionState.CONFIRMED, "arm"):
            self._require_files_as_read("arm")
            assert self.processes is not None
            description = SessionDescription(
                rig=self.rig,
                plan=json.loads(self.plan.to_json()),
                payload=self.payload,
                operator=self.operator,
                clock_source=self._clock_source,
                role=self.role,
                weighed_mass=self.weighed_mass,
                remarks=self.remarks,
                controllers=self._controllers,
            )
            # Attached while the writer lives: what the recorder, should it die, has not written is then still ours to save.
            self._rows = RingReader(f"{self._ring}-rows")
            self.file = claim_recording(self.experiment)
            order = RecorderOrder(
                self.file,
                description,
                f"{self._ring}-rows",
                f"{self._ring}-frames",
                claimed=True,
                provisional=self._provisional,
            )
            self.processes.record(order)
            self.processes.order("arm", str(self.file))
            self._await(lambda: self.state is SessionState.ARMED, _CHECK_TIMEOUT, "arming took too long")
            if self.state is not SessionState.ARMED:
                raise StepOutOfTurn(f"not armed: {self.reason}")

    def start(self) -> None:
        """The robot moves. Returns at once. Raises StepOutOfTurn unless armed."""
        with self._step(SessionState.ARMED, "start"):
            self._require_files_as_read("start")
            assert self.processes is not None
            self._enter(SessionState.RUNNING, "started by the operator")
            self.processes.order("start")

    def stop(self, reason: str = "operator's stop") -> None:
        """Bring the axes to rest and end the session; at any time, from any thread, harmless when repeated."""
        if self.state.ended:
            return
        if self.processes is None:
            self._end(SessionState.ABORTED, reason)
        else:
            self.processes.stop(reason)

    def wait(self, timeout: float | None = None) -> SessionState:
        """Wait until the session has ended, at most `timeout` s; its state then."""
        with self._changed:
            self._changed.wait_for(lambda: self.state.ended, timeout)
        return self.state

    def close(self) -> None:
        """End everything: stop if need be, and wait for the processes. Harmless when repeated, also by several threads
        at once: who comes later waits until all is closed."""
        self.stop("the session was closed")
        self.wait(_CLOSE_TIMEOUT)
        self._closing.set()
        # A thread of the session's own is waited for by who closes it, and must not wait for them.
        if not self._closer.acquire(blocking=threading.current_thread() not in self._threads):
            return
        try:
            self._close()
        finally:
            self._closer.release()

    def _close(self) -> None:
        if self.processes is not None:
            self.processes.end(_CLOSE_TIMEOUT)
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(_CLOSE_TIMEOUT)
        if self._live is not None:
            self._live.close()
            self._live = None
        if self._rows is not None:
            self._rows.close()
            self._rows = None
        if self.processes is not None:
            self.processes.close()
        if self._made_experiment and self.file is None:
            self._made_experiment = False
            discard_unused(self.experiment)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # ---- what can be seen ----

    @property
    def progress(self) -> Progress:
        """How far the plan has been driven."""
        return self._progress

    def live(self, seconds: float) -> LiveRows:
        """The newest samples, at most `seconds` of them, in SI units; none before the session is checked."""
        if self._live is None:
            self._live = LiveView.attach(self.rig, f"{self._ring}-rows")
        return LiveRows.empty(self.rig) if self._live is None else self._live.latest(seconds)

    # ---- behind ----

    def _in_turn(self, needed: SessionState, step: str) -> None:
        if self.state is not needed:
            ended = f" ({self.reason})" if self.reason else ""
            raise StepOutOfTurn(
                f"cannot {step}: the session is {self.state.value}{ended}, it must be {needed.value}"
            )

    def _enter(self, state: SessionState, sentence: str) -> None:
        with self._changed:
            if state not in TRANSITIONS[self.state]:
                return
            self.state = state
            if state.ended:
                self.reason = (
                    sentence if not self.alarm or self.alarm in sentence else f"{sentence}; {self.alarm}"
                )
            self._changed.notify_all()
        self._on_event(SessionEvent("state", state, sentence))

    def _end(self, state: SessionState, sentence: str) -> None:
        if self._failed and state is SessionState.ABORTED:
            state, sentence = SessionState.FAULTED, self._failed
        self._enter(state, sentence)

    def _await(self, condition: Callable[[], bool], timeout: float, reason: str) -> None:
        with self._changed:
            if not self._changed.wait_for(lambda: condition() or self.state.ended, timeout):
                late = True
            else:
                late = False
        if late:
            self.stop(reason)
            self.wait(_CLOSE_TIMEOUT)
            self._end(SessionState.FAULTED, reason)  # where its processes answer to nothing

    def _beat(self) -> None:
        assert self.processes is not None
        while not self._closing.wait(_BEAT) and self._ended is None:
            if self._could_stop_now():
                self.processes.say("beat")

    def _listen(self) -> None:
        """The session's own thread: takes the acquisition process's words until its end."""
        assert self.processes is not None
        try:
            while self._ended is None:
                try:
                    self._hear(self.processes.hear())
                except (EOFError, OSError):
                    died = StopReason(
                        StopCause.INTERNAL, f"the acquisition process died{self._power_after_death()}"
                    )
                    self._ended = AcquisitionMessage("ended", died.words, reason=died, alarm=self.alarm)
            self._finish(self._ended.reason or StopReason(StopCause.INTERNAL, self._ended.words))
        except Exception as error:
            self._end(
                SessionState.FAULTED, f"the session could not be brought to its end: {error_in_words(error)}"
            )

    def _hear(self, message: AcquisitionMessage) -> None:
        match message.what:
            case "checked":
                assert message.check is not None
                self.remarks, self._clock_source = message.remarks, message.clock_source
                self._controllers = message.controllers
                self._held_before = message.held_before
                if message.check.ok:
                    self._enter(SessionState.CHECKED, "; ".join(["the rig is ready", *message.remarks]))
                with self._changed:
                    self.rig_check = message.check
                    self._changed.notify_all()
            case "armed":
                self._enter(SessionState.ARMED, "armed: recording and monitors run; starting moves the robot")
            case "progress":
                elapsed = message.cycle * self.rig.cycle
                self._progress = Progress(message.cycle, message.cycles, elapsed, message.first)
                data = {
                    "cycle": message.cycle,
                    "cycles": message.cycles,
                    "fraction": self._progress.fraction,
                    "elapsed": elapsed,
                }
                self._on_event(SessionEvent("progress", self.state, "", data))
            case "alarm":
                self._sound(message.words)
            case "ended":
                self.alarm = message.alarm
                self._ended = message
                for left in message.remarks:
                    self._on_event(SessionEvent("remark", self.state, f"not as it was found: {left}"))
            case "moving":
                pass  # `start` has said so already

    def _sound(self, alarm: str) -> None:
        """Tell a person what must be done now."""
        self.alarm = alarm
        self._on_event(SessionEvent("alarm", self.state, alarm))

    def _power_after_death(self) -> str:
        """The process that owned the bus died: have the drives' power taken from here, and say what they said."""
        if self.processes is not None:
            self.processes.wait_for_acquisition()
        if self.state not in (SessionState.ARMED, SessionState.RUNNING):
            return ""
        if self.rig.bus.interface == "virtual":
            return ", and its simulated drives with it"
        report = take_power(self.rig, self._held_before)
        if report.alarm:
            self._sound(report.alarm)
            return "; the drives, which heard nothing of it any more, had to stop by themselves"
        return "; power was taken from the drives and read back as off"

    def _finish(self, reason: StopReason) -> None:
        """The motion has ended: see the files closed; what comes after a complete session runs before it is done."""
        if self.processes is not None:
            self.processes.wait_for_recording()
        outcome = outcome_of(
            reason, self.experiment, self.file, self.payload, self.role, self._rows, self._admissible
        )
        self.file = outcome.file
        if outcome.state is SessionState.DONE and outcome.file is not None:
            self._progress = Progress(
                len(self._counts), len(self._counts), len(self._counts) * self.rig.cycle
            )
            self._run_after(Recorded(self.experiment, outcome.file, self.payload.name))
        self._end(outcome.state, outcome.sentence)

    def _run_after(self, recorded: Recorded) -> None:
        if self._after_session is None:
            return
        try:
            self._after_session(recorded)
        except Exception as error:
            self._on_event(
                SessionEvent(
                    "remark", self.state, f"after the session, nothing is lost: {error_in_words(error)}"
                )
            )


def _unheard(event: SessionEvent) -> None:
    """Where nobody listens."""


def _seed_of(recording: Path) -> int:
    """A simulated session's seed: its number, so that sessions differ and each is the same every time."""
    return int(recording.stem.rpartition("-")[2])
