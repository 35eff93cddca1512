"""What the planner asks of a model: its regressor and its torque. `api` hands in an object that has it.

The planner knows nothing of rigid bodies or friction: it plans for whatever linear model it is given.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from daq.excitation.blend import Array
from daq.excitation.excitation_plan import ExcitationPlan
from identify.recording.experiment_file import Payload


@dataclass(frozen=True)
class PlannedParameter:
    """One parameter that is to be identified."""

    name: str
    joint: str
    unit: str
    effect: str | None
    """name of the effect that it belongs to; None for the rigid robot's own"""
    value: float | None
    """what is known of it beforehand; None where it is only assumed"""


@dataclass(frozen=True)
class PlannedMotion:
    """Samples of a plan as one session with one payload would run it; (N, n) unless said otherwise."""

    payload: Payload
    time: Array
    """(N,) s since the session began"""
    q: Array
    dq: Array
    ddq: Array
    period: float
    """s between samples"""

    @classmethod
    def of(cls, plan: ExcitationPlan, payload: Payload, period: float) -> "PlannedMotion":
        """A whole plan, sampled in the middle of every period."""
        time = np.arange(0.5 * period, plan.duration, period)
        return cls(payload, time, *plan.setpoints(time), period)


@dataclass(frozen=True)
class JointCoverage:
    """What the sessions of a plan make one joint do; shares are of the joint's moving time over all
    sessions.
    """

    joint: str
    position_range: tuple[float, float]
    """rad or m"""
    position_share: float
    """of the range that the limits allow"""
    highest_speed_share: float
    """of the speed that the limits allow"""
    slow_forwards: float
    slow_backwards: float
    """share of time at a steady speed that the model calls slow, by direction"""
    fast: float
    """share of time at a speed that the model calls fast"""
    quadrants: tuple[float, float, float, float]
    """share of time in quadrants 1 to 4 of Fig. 2, (speed, load): (+, +), (−, +), (−, −), (+, −)"""
    load_range: tuple[float, float]
    """N m, as predicted, over all sessions"""
    payload_masses: tuple[float, ...]
    """kg, of the sessions"""


@dataclass(frozen=True)
class Hidden:
    """Effects of one joint that a plan does not show, with the reason and what would show them."""

    joint: str
    effects: tuple[str, ...]
    reason: str
    remedy: str


@dataclass(frozen=True)
class PlanJudgement:
    """What the sessions of a plan make each joint do, and the effects that they do not show."""

    covered: tuple[JointCoverage, ...]
    hidden: tuple[Hidden, ...]


class PlanModel(Protocol):
    """A model that is linear in its parameters, with a guess of them."""

    @property
    def name(self) -> str:
        """As the user named it."""
        ...

    @property
    def parameters(self) -> tuple[PlannedParameter, ...]:
        """(p) the parameters, in the order of the columns."""
        ...

    @property
    def source(self) -> str:
        """In words, where the values that loads and torques are predicted with come from."""
        ...

    @property
    def is_identified(self) -> bool:
        """Whether those values were measured on this machine; a torque predicted with assumed ones
        forbids nothing.
        """
        ...

    def rows(self, motion: PlannedMotion) -> list[tuple[NDArray[np.intp], Array]]:
        """For every joint the indices (k,) and columns (N, k), N m per unit, of the parameters on its
        rows.
        """
        ...

    def torque(self, motion: PlannedMotion) -> Array:
        """(N, n) N m: joint torque that the motion will ask for, friction included."""
        ...

    def load(self, motion: PlannedMotion) -> Array:
        """(N, n) N m: the part of the torque that the gears drive, τ_out of eq. (6)."""
        ...

    def judge(self, motions: Sequence[PlannedMotion]) -> PlanJudgement:
        """What sessions of these motions cover, and what they do not show: the effects themselves are asked."""
        ...
