"""Whether a session that did not reach its plan's end may serve identification.

What was measured until then is as good as any other sample; the question is whether there is enough of it, and whether
the machine was in order. The rule:

- the session ended because of this computer (a process died or was killed, a power cut, a full disk), not because of the
  machine or of somebody's decision. After a limit, a fault, an EMCY or an operator's stop a person decides;
- the joints moved for at least `LEAST_MOTION`, or for half of a plan that is shorter than twice that;
- at least `LEAST_WHOLE` of its rows have an answer of every drive.

Nothing else is asked: identification itself leaves out what its filters cannot use, and says so.
"""

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from daq.excitation.excitation_plan import ExcitationPlan
from daq.safety import StopCause
from daq.samples import COMMAND_CAME, POSITION_CAME
from identify.recording.session_hdf5 import CYCLE, SETPOINT, VALID

LEAST_MOTION = 10.0
"""s"""
LEAST_WHOLE = 0.9
"""share of the rows"""

OF_THIS_COMPUTER = frozenset(
    {
        StopCause.DEAD_PARENT,
        StopCause.RECORDER,
        StopCause.FULL_DISK,
        StopCause.INTERNAL,
        StopCause.LOST_FRAMES,
        StopCause.HELD_UP,
    }
)
"""causes that say nothing against the machine"""


@dataclass(frozen=True)
class Measured:
    """What a recording holds of its plan."""

    lasted: float
    """s that were recorded"""
    planned: float
    """s of the plan"""
    moved: float
    """s in which a joint was told to move"""
    whole: float
    """share of the rows in which every drive answered"""
    cause: str
    """the `StopCause`; empty where the recording does not say"""

    @property
    def words(self) -> str:
        """For the operator."""
        return f"{self.lasted:.1f} s of {self.planned:.1f} s of the plan were measured"

    @property
    def lacks(self) -> str:
        """What it lacks for identification; empty where it may serve."""
        least = min(LEAST_MOTION, 0.5 * self.planned)
        if self.moved < least:
            return f"{self.moved:.1f} s of motion are too little, {least:.1f} s are needed"
        if self.whole < LEAST_WHOLE:
            return f"only {100 * self.whole:.0f} % of the rows have an answer of every drive"
        return ""

    @property
    def needs_a_person(self) -> bool:
        """Whether a person must decide, because the machine or somebody ended the motion."""
        return self.cause not in OF_THIS_COMPUTER


def measured(path: Path) -> Measured:
    """Look at a closed recording.

    Raises OSError, KeyError or ValueError where it is no recording of ours.
    """
    with h5py.File(path, "r") as file:
        period = float(np.asarray(file.attrs["cycle"]))
        plan = ExcitationPlan.model_validate_json(str(file.attrs["plan"]))
        setpoint, valid = np.asarray(file[SETPOINT]), np.asarray(file[VALID])
        rows = len(np.asarray(file[CYCLE]))
        both = POSITION_CAME | COMMAND_CAME
        whole = ((valid & both) == both).all(axis=1)
        return Measured(
            lasted=rows * period,
            planned=plan.duration,
            moved=float(np.any(np.diff(setpoint, axis=0) != 0, axis=1).sum() * period),
            whole=float(whole.mean()) if rows else 0.0,
            cause=str(file.attrs.get("stop_cause", "")),
        )
