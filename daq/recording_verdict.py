"""What is to be said against a recording that reached its plan's end: losses, lateness, a signal that does not move.

None of it endangers anybody, so the motion goes on; but a model must not be fitted to it unseen. A recording with a
verdict is kept, is not listed by itself, and says why.

- *Losses*: fewer than `LEAST_WHOLE` of the rows have an answer of every drive (the rule of `daq.admission`);
- *late, doubled*: more than `MOST_ODD` of a drive's answers came a cycle late, or more than once;
- *behind*: a drive's answers fall behind by whole cycles and stay so. In bus order such an answer cannot be told from one
  that is in time. But where it began an answer lacks, and over that gap the joint seems to have gone one cycle's way less
  than it did: the positions before and after fit one smooth course only if those after are moved back;
- *stuck*: a command, or a position, that does not change while the joint is told to move.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.admission import LEAST_WHOLE
from daq.rig import Rig
from daq.samples import CAME_AGAIN, CAME_LATE, COMMAND_CAME, POSITION_CAME, Phase

MOST_ODD = 0.05
"""share of a drive's answers"""
STUCK = 1.0
"""s of motion, at least, without any change of the value"""
STUCK_SHARE = 0.25
"""of the motion, likewise"""
_AROUND = 5
"""rows on either side of a gap that are looked at"""
_LONGEST_GAP = 5
"""rows: a longer one is lost data, and nothing is read from it"""
_CLEARLY = 5.0
"""how many times better the course must fit with the answers moved than without"""


@dataclass
class _Still:
    """The longest stretch of motion in which a value did not change."""

    last: int | None = None
    run: int = 0
    longest: int = 0
    value: int = 0
    """of the longest stretch"""

    def take(self, values: NDArray[np.int64]) -> None:
        """The values (M,) of the next rows of motion."""
        if not len(values):
            return
        before = values[0] - 1 if self.last is None else self.last
        changes = np.flatnonzero(np.diff(np.concatenate([[before], values])) != 0)
        starts = np.concatenate([[-self.run], changes])
        lengths = np.diff(np.concatenate([starts, [len(values)]]))
        best = int(np.argmax(lengths))
        if int(lengths[best]) > self.longest:
            self.longest, self.value = int(lengths[best]), int(values[max(0, int(starts[best]))])
        self.run, self.last = int(lengths[-1]), int(values[-1])


@dataclass
class _Joint:
    """What was counted for one drive."""

    came: int = 0
    late: int = 0
    again: int = 0
    behind: int = 0
    """cycles by which its answers have fallen behind, as far as gaps in motion show"""
    command: _Still = field(default_factory=_Still)
    position: _Still = field(default_factory=_Still)
    recent: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    """positions in counts, NaN where none came"""


class RecordingVerdict:
    """Takes the rows of a recording as they come; says at the end what is to be said against it."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._joints = [_Joint() for _ in rig.axes]
        self._rows = self._whole = self._moving = 0
        self._setpoint: NDArray[np.int64] | None = None
        self._first_unanswered = [False for _ in rig.axes]
        self._begun = False

    def see(self, rows: NDArray[Any]) -> None:
        """All rows (M,) of the ring, recorded or not: where answers fell behind may lie before the plan's begin.

        The very first SYNC is answered by every drive that answers in time.
        """
        if not self._begun and len(rows) and int(rows["cycle"][0]) == 0:
            came = (rows["valid"] & POSITION_CAME) != 0
            for axis in range(len(self._joints)):
                later = came[1:_AROUND, axis]
                self._first_unanswered[axis] = not came[0, axis] and len(later) > 2 and bool(later.all())
        self._begun = self._begun or len(rows) > 0
        for axis, joint in enumerate(self._joints):
            valid = rows["valid"][:, axis]
            came = (valid & POSITION_CAME) != 0
            self._look_for_gaps(joint, np.where(came, rows["position"][:, axis], np.nan), valid)

    def take(self, rows: NDArray[Any]) -> None:
        """The next recorded rows (M,) of `daq.samples.sample_dtype`."""
        if not len(rows):
            return
        valid = rows["valid"]
        both = POSITION_CAME | COMMAND_CAME
        self._rows += len(rows)
        self._whole += int(((valid & both) == both).all(axis=1).sum())
        setpoint = rows["setpoint"].astype(np.int64)
        before = setpoint[:1] if self._setpoint is None else self._setpoint[None, :]
        moves = np.diff(np.concatenate([before, setpoint]), axis=0) != 0
        self._setpoint = setpoint[-1]
        planned = rows["phase"] == Phase.PLAN
        self._moving += int((moves.any(axis=1) & planned).sum())
        for axis, joint in enumerate(self._joints):
            came = (valid[:, axis] & POSITION_CAME) != 0
            joint.came += int(came.sum())
            joint.late += int(((valid[:, axis] & CAME_LATE) != 0).sum())
            joint.again += int(((valid[:, axis] & CAME_AGAIN) != 0).sum())
            judged = moves[:, axis] & planned & came
            joint.command.take(rows["command"][judged, axis].astype(np.int64))
            joint.position.take(rows["position"][judged, axis].astype(np.int64))

    def _look_for_gaps(self, joint: _Joint, position: NDArray[Any], valid: NDArray[Any]) -> None:
        old = len(joint.recent)
        course = np.concatenate([joint.recent, position])
        missing = np.isnan(course)
        joint.recent = course[-(2 * _AROUND + _LONGEST_GAP) :]
        if (valid & CAME_AGAIN).any():
            # Where answers catch up, two come in one cycle.
            joint.behind = 0
        if not missing.any():
            return
        edges = np.flatnonzero(np.diff(np.concatenate([[False], missing, [False]]).astype(int)))
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            complete = end + _AROUND
            # A gap is looked at once, when as many rows as are needed have come after it.
            if begin < _AROUND or end - begin > _LONGEST_GAP or not max(old, 0) < complete <= len(course):
                continue
            before, after = course[begin - _AROUND : begin], course[end:complete]
            if not (np.isnan(before).any() or np.isnan(after).any()):
                joint.behind += _cycles_behind(before, after, int(end - begin))

    def problems(self) -> list[str]:
        """One sentence for each thing that is to be said; none where the recording may be listed."""
        if not self._rows:
            return []
        problems: list[str] = []
        whole = self._whole / self._rows
        if whole < LEAST_WHOLE:
            problems.append(
                f"only {100 * whole:.0f} % of the rows have an answer of every drive, {100 * LEAST_WHOLE:.0f} % are needed: look "
                "at wiring, termination and the load of the bus"
            )
        for axis, joint in enumerate(self._joints):
            name = f"joint {self._rig.axes[axis].joint}"
            late, again = (count / max(1, joint.came) for count in (joint.late, joint.again))
            if late > MOST_ODD:
                problems.append(
                    f"{name}: {100 * late:.0f} % of the answers came a cycle late: lengthen the cycle"
                )
            if again > MOST_ODD:
                problems.append(
                    f"{name}: {100 * again:.0f} % of the answers came more than once: is there a second node with its id?"
                )
            if joint.behind or self._first_unanswered[axis]:
                problems.append(
                    f"{name}: its answers fell {max(1, joint.behind)} cycle(s) behind and stayed so, so that they are in the "
                    "wrong rows: lengthen the cycle"
                )
            problems += self._stuck(name, joint)
        return problems

    def _stuck(self, name: str, joint: _Joint) -> list[str]:
        least = max(STUCK / self._rig.cycle, STUCK_SHARE * self._moving)
        problems: list[str] = []
        for what, still in (("current", joint.command), ("position", joint.position)):
            if still.longest >= least:
                problems.append(
                    f"{name}: the {what} stood at {still.value} counts for {still.longest * self._rig.cycle:.1f} s of motion: "
                    "is the right object mapped (the drive's profile), and does the drive update it in this mode?"
                )
        return problems


def _cycles_behind(before: NDArray[Any], after: NDArray[Any], gap: int) -> int:
    """By how many cycles the answers after a gap have fallen behind; 0 where that cannot be told.

    before, after : (`_AROUND`,) positions in counts
    """
    misfits: list[float] = []
    for behind in range(gap + 1):
        place = np.concatenate([np.arange(-_AROUND, 0), np.arange(_AROUND) + gap - behind])
        place = place.astype(float)
        values = np.concatenate([before, after])
        fitted = np.polynomial.polynomial.polyfit(place, values, 2)
        left = values - np.polynomial.polynomial.polyval(place, fitted)
        # An encoder rounds: less than that is no misfit.
        misfits.append(float(left @ left) + len(values) / 12.0)
    best = int(np.argmin(misfits))
    return best if best and misfits[0] > _CLEARLY * misfits[best] else 0
