"""A motion from armed to rest: samples are taken, everything is watched, and what happened is told as one story.

Stopping escalates. A quick stop is commanded and watched (`daq.stopping_watch`); where it does not do what it should, or
no sample tells, power is cut by every means (`daq.power_off`). At the end every drive is read back: "switched off" is said
of what was seen, else a person is told to press the emergency stop.
"""

import time
from typing import Protocol

from daq.motion_sequence import BRAKES_CLOSE, MotionSequence, Step
from daq.power_off import EMERGENCY_STOP, PowerCut, PowerReport
from daq.rig import Rig
from daq.rig_drives import RigDrives
from daq.safety import StopCause, StopReason
from daq.sampling_loop import SamplingLoop

_TELL_EVERY = 0.2
"""s between two words about progress"""
_EMERGENCY_WAIT = 1.0
"""s for the EMCY that says why a drive has failed; the axes are at rest by then"""
_SILENT = 0.1
"""s without any sample, at least, after which a stop is no longer left to the drives"""
_AFTER_CUT = 5.0
"""s, at most, for which samples are still taken once power was cut"""

_FATAL = frozenset({StopCause.BUS, StopCause.LOST_SYNC, StopCause.SILENT_DRIVE})
"""causes that, while an axis should stop, leave nobody to see that it does"""


_EXPLAINED_BY = {
    StopCause.EMERGENCY: frozenset({StopCause.DRIVE_FAULT}),
    StopCause.RESTARTED: frozenset(
        {StopCause.DRIVE_FAULT, StopCause.SILENT_DRIVE, StopCause.LOST_HEARTBEAT, StopCause.EMERGENCY}
    ),
}
"""by what a drive says of itself: the causes that it is behind"""


def _same(one: StopCause, other: StopCause) -> bool:
    """Whether two causes are one event, told in two ways."""
    return one is other or one in _EXPLAINED_BY.get(other, ()) or other in _EXPLAINED_BY.get(one, ())


class EndStory:
    """Why a motion ended, and what else came up until it rested; each thing once, in the order in which it came."""

    def __init__(self) -> None:
        self.reason: StopReason | None = None
        self._also: list[StopReason] = []

    def first(self, reason: StopReason) -> None:
        """The reason, or something else that came up after it."""
        if self.reason is None:
            self.reason = reason
        elif not any(_same(reason.cause, each.cause) for each in (self.reason, *self._also)):
            self._also.append(reason)

    def explain(self, emergency: StopReason) -> None:
        """A drive's EMCY, which says why it left OPERATION ENABLED where the statusword only says that it did; or its
        boot-up, which says why it fell silent.

        The two come by different ways (EMCY by canopen, statuswords by the receive path), so either may be first.
        """
        if self.reason is not None and self.reason.cause in _EXPLAINED_BY[emergency.cause]:
            self.reason = StopReason(emergency.cause, f"{emergency.words}; {self.reason.words}")
        else:
            self.first(emergency)

    def told(self) -> StopReason:
        """Cause and words of all."""
        assert self.reason is not None
        also = "".join(f"; while stopping: {each.words}" for each in self._also)
        return StopReason(self.reason.cause, self.reason.words + also)


class Supervision(Protocol):
    """Who watches and is told while the axes move: the acquisition process."""

    rig: Rig
    start_asked: bool
    alarm: str

    @property
    def plan_cycles(self) -> int:
        """Cycles of the plan."""
        ...

    def watch(self, drives: RigDrives) -> StopReason | None:
        """What ends a motion and comes neither with a sample nor from a drive. Raises BusError."""
        ...

    def tell_moving(self) -> None:
        """The axes get power now."""
        ...

    def tell_progress(self, cycle: int, cycles: int, first: int | None) -> None:
        """How far the plan has been driven, and at which SYNC it begins."""
        ...

    def tell_alarm(self, alarm: str) -> None:
        """What a person must do now; empty words take it back."""
        ...


class Motion:
    """Turns of the sampling loop until the axes rest without power."""

    def __init__(
        self,
        acquisition: Supervision,
        loop: SamplingLoop,
        sequence: MotionSequence,
        drives: RigDrives,
        story: EndStory,
    ) -> None:
        self._acquisition = acquisition
        self._rig = acquisition.rig
        self._plan = acquisition.plan_cycles
        self._loop = loop
        self._sequence = sequence
        self._drives = drives
        self._story = story
        self._cut: PowerCut | None = None
        self._cut_at = 0.0
        self._told = 0.0
        self._done = 0
        self._silence = max(self._rig.supervision.silence, 5 * self._rig.cycle, _SILENT)

    def run(self) -> None:
        """From armed to rest. Raises BusError when the bus fails."""
        sequence = self._sequence
        last_row = time.monotonic()
        while sequence.step is not Step.ENDED:
            rows, reason = self._loop.turn(closely=sequence.step not in (Step.MOVING, Step.SETTLING))
            sequence.remember(rows)
            reasons = (self._acquisition.watch(self._drives), self._drives.trouble(), reason)
            if self._acquisition.start_asked and sequence.step is Step.STANDBY and sequence.reason is None:
                self._acquisition.tell_moving()
                sequence.begin()
            for reason in reasons:
                if reason is not None:
                    self._stop(reason)
            sequence.take(rows)
            now = time.monotonic()
            if len(rows):
                last_row = now
            elif sequence.step is Step.STOPPING and now - last_row > self._silence:
                sequence.cut(f"no sample came for {now - last_row:.2g} s while the axes should stop")
            elif sequence.step is Step.POWERING_OFF and now - last_row > self._silence:
                sequence.give_up()
            self._go_on_cutting(now, now - last_row > self._silence)
            self._progress(now)
        if sequence.reason is not None:
            self._story.first(sequence.reason)

    def _stop(self, reason: StopReason) -> None:
        """Something ends the motion, or has come up while it ends."""
        sequence = self._sequence
        if reason.cause is StopCause.HELD_UP and not sequence.moves:
            return
        stopping = sequence.step in (Step.STOPPING, Step.CUT, Step.POWERING_OFF)
        if reason.cause in _EXPLAINED_BY:
            self._story.explain(reason)
        elif not (stopping and reason.cause is StopCause.LIMIT):
            # What goes beyond a limit while an axis brakes is the stopping watch's business.
            self._story.first(reason)
        if sequence.step is Step.STOPPING and reason.cause in _FATAL:
            known = self._story.reason is not None and self._story.reason.cause is reason.cause
            sequence.cut("so nobody can see whether the axes stop" if known else reason.words)
        sequence.stop(self._story.reason or reason)

    def _go_on_cutting(self, now: float, silent: bool) -> None:
        sequence = self._sequence
        if not sequence.cut_because:
            return
        if self._cut is None:
            self._cut_at = now
            self._cut = self._drives.cut(self._loop.setpoints.cut, self._alarm)
            self._cut.start()
            if self._rig.pacing != "real-time":
                # Simulated time would race on meanwhile.
                self._cut.wait()
            return
        coasted = sequence.lasted >= BRAKES_CLOSE or (silent and now - self._cut_at >= BRAKES_CLOSE)
        blind = self._cut.done and coasted and (silent or sequence.silent or bool(sequence.unseen))
        too_long = now - self._cut_at > max(_AFTER_CUT, self._rig.supervision.stop_timeout)
        if sequence.step is Step.CUT and (blind or too_long):
            sequence.give_up()

    def _progress(self, now: float) -> None:
        if now - self._told < _TELL_EVERY:
            return
        self._told = now
        setpoints = self._loop.setpoints
        if setpoints.length:
            self._done = max(self._done, setpoints.done - setpoints.before_plan)
        began = setpoints.began
        planned = began is not None and setpoints.before_plan < setpoints.length
        first = began + setpoints.before_plan if began is not None and planned else None
        self._acquisition.tell_progress(self._done, self._plan, first)

    def _alarm(self, alarm: str) -> None:
        self._acquisition.alarm = alarm
        self._acquisition.tell_alarm(alarm)

    def cut_in_vain(self) -> None:
        """An error of ours in motion: take the power, whatever the sequence says."""
        if self._cut is None:
            self._cut = self._drives.cut(self._loop.setpoints.cut, self._alarm)
            self._cut.start()
        self._cut.wait()
        self._report_alarm(self._drives.power())

    def read_back(self) -> StopReason:
        """The end's reason with what the drives say of their power, read now; what a person must do, where something is left."""
        if self._story.reason is None:
            self._story.first(StopReason(StopCause.INTERNAL, "the motion ended without a reason"))
        if self._cut is not None:
            self._cut.wait()
        report = self._drives.power()
        because = self._sequence.cut_because
        if not report.off and self._cut is None:
            because = because or "a drive still had power"
            self._cut = self._drives.cut(self._loop.setpoints.cut, self._alarm)
            self._cut.start()
            self._cut.wait()
            report = self._drives.power()
        self._explain_by_emergency()
        reason = self._story.told()
        sentence = reason.words
        if self._cut is not None:
            seen = "and was read back as off" if report.off else "and was not read back as off"
            sentence = f"{sentence}; {because}: power was cut by every means {seen}"
        alarm = self._report_alarm(report)
        if alarm:
            sentence = f"{sentence}; {alarm}"
        cause = reason.cause
        if not report.off and cause is StopCause.PLAN_DONE:
            cause = StopCause.POWER_NOT_OFF
        return StopReason(cause, sentence)

    def _explain_by_emergency(self) -> None:
        """The drive's own word for what ended the motion, or came up while it ended."""
        reason = self._story.reason
        fault = reason is not None and reason.cause is StopCause.DRIVE_FAULT
        emergency = self._drives.emergency(_EMERGENCY_WAIT if fault else 0.0)
        if emergency is not None:
            self._story.explain(emergency)
        restart = self._drives.restart()
        if restart is not None:
            self._story.explain(restart)

    def _report_alarm(self, report: PowerReport) -> str:
        """Say what a person must do; or take it back, once every drive was read back as off. What was said."""
        alarm = self._for_a_person(report)
        if alarm != self._acquisition.alarm:
            self._alarm(alarm)
        return alarm

    def _for_a_person(self, report: PowerReport) -> str:
        """What a person must do now; empty where every axis has no power and rests, as far as is known."""
        unseen = self._sequence.unseen
        if not unseen:
            return report.alarm
        watch = (
            f"whether joint {unseen} rests cannot be seen from its position: keep clear until you see it rest, or"
            f" {EMERGENCY_STOP}"
        )
        return f"{report.alarm}; {watch}" if report.alarm else watch
