"""An excitation plan: phases one after the other, in closed form, so that a file reproduces the trajectory
exactly.

The file is stored with the recording. It holds no samples: `setpoints` evaluates the formulas of
`sinusoid.py` and `trapezoid.py` at any times.
"""

import json
from pathlib import Path
from typing import Annotated, Literal, NamedTuple, Self, cast

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from daq.excitation.blend import Array
from daq.excitation.sinusoid import Sinusoids
from daq.excitation.trapezoid import Dwell, Move
from daq.json_object import JsonObject
from identify.recording.errors import InputError
from identify.recording.first_fault import first_fault
from identify.recording.plain_text import LONGEST_NAME, Name, check_printable

PlanName = Annotated[str, Field(max_length=LONGEST_NAME), AfterValidator(check_printable)]
"""As other names are, or none."""
Phase = Annotated[Sinusoids | Move | Dwell, Field(discriminator="kind")]


class Setpoints(NamedTuple):
    """Samples of a plan, (N, n) each, in joint space."""

    position: Array
    """rad or m"""
    velocity: Array
    """rad/s or m/s"""
    acceleration: Array
    """rad/s² or m/s²"""


class ExcitationPlan(BaseModel):
    """What the joints are to do, from a start position on, at rest before and after."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    format: Literal[1] = 1
    name: PlanName = ""
    rig: PlanName = ""
    """name of the rig that it was made for"""
    model: PlanName = ""
    """the model that it was made for"""
    joints: tuple[Name, ...] = Field(min_length=1)
    start: tuple[float, ...]
    """(n,) rad or m: where the joints must be when it begins"""
    phases: tuple[Phase, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _connected(self) -> Self:
        n = len(self.joints)
        if len(self.start) != n:
            raise ValueError(f"start must have {n} positions, not {len(self.start)}")
        position = np.array(self.start, dtype=float)
        for number, phase in enumerate(self.phases):
            if isinstance(phase, Sinusoids):
                goal = np.array(phase.centre)
            elif isinstance(phase, Move):
                goal = np.array(phase.to)
            else:
                goal = position
            if len(goal) != n:
                raise ValueError(f"phases.{number}: {n} joints, but {len(goal)} positions")
            if isinstance(phase, Sinusoids) and np.abs(goal - position).max() > 1e-9:
                raise ValueError(f"phases.{number}: its centre is not where the phase before ends")
            position = goal
        return self

    @property
    def duration(self) -> float:
        """s"""
        return float(self.boundaries[-1])

    @property
    def boundaries(self) -> Array:
        """(phases + 1,) s: where each phase begins, and the end."""
        return np.concatenate([[0.0], np.cumsum([phase.duration for phase in self.phases])])

    @property
    def repeated(self) -> tuple[tuple[float, float, float], ...]:
        """(begin, end, period) in s of every stretch in which the motion repeats exactly."""
        return tuple(
            (float(begin + phase.repeated[0]), float(begin + phase.repeated[1]), 1.0 / phase.frequency)
            for begin, phase in zip(self.boundaries, self.phases, strict=False)
            if isinstance(phase, Sinusoids)
        )

    def setpoints(self, times: Array) -> Setpoints:
        """Position, velocity, acceleration at `times` (N,), s from the plan's start; at rest before and
        after.
        """
        return Setpoints(*self.evaluate(times)[:3])

    def evaluate(self, times: Array) -> tuple[Array, Array, Array, Array]:
        """Position, velocity, acceleration and jerk, (N, n) each, at `times` (N,), s."""
        times = np.clip(np.atleast_1d(np.asarray(times, dtype=float)), 0.0, self.duration)
        edges = self.boundaries
        where = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, len(self.phases) - 1)
        out = tuple(np.empty((len(times), len(self.joints))) for _ in range(4))
        position = np.array(self.start, dtype=float)
        for number, phase in enumerate(self.phases):
            rows = np.flatnonzero(where == number)
            if len(rows):
                for target, values in zip(
                    out, phase.evaluate(times[rows] - edges[number], position), strict=True
                ):
                    target[rows] = values
            position = phase.end(position)
        return out[0], out[1], out[2], out[3]

    def to_json(self) -> str:
        """The plan file's text; numbers with all their digits."""
        return self.model_dump_json(indent=1) + "\n"

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a plan file (JSON), or the plan within what `coulomb plan --json` printed.

        Raises InputError with one line that names the file and the field.
        """
        try:
            document = json.loads(Path(path).read_text(encoding="utf-8"))
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror}") from None
        except UnicodeDecodeError as error:
            raise InputError(f"{path}: cannot be read ({error})") from None
        except json.JSONDecodeError as error:
            raise InputError(f"{path}, line {error.lineno}: not JSON ({error.msg})") from None
        except (ValueError, RecursionError):
            raise InputError(
                f"{path}: no plan: lists too deep within each other, or a number of too many digits"
            ) from None
        if isinstance(document, dict):
            report = cast(JsonObject, document)
            if isinstance(report.get("plan"), dict):
                document = report["plan"]
        try:
            return cls.model_validate(document)
        except ValidationError as error:
            raise InputError(f"{path}: {first_fault(error)}") from None
