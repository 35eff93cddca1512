"""An effect is an object: a name, an equation, columns of the regressor, and what it needs to be seen."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from enum import Enum
from typing import Literal

import numpy as np

from identify.effects.conditions import Condition, Obstacle
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter, Relation
from identify.effects.picture import OVER_SPEED, PictureVariable

Constants = Mapping[str, float]
"""Nonlinear constants of an effect by name, e.g. {"stribeck_velocity": 0.03}."""

Simulated = Literal["instant", "state", "give", "command"]
"""How a simulation forms an effect's torque: from the state at the instant; with a state of its own (`state_at_start`,
`state_after`, `columns_of_state`); as a give between motor and link, whose motions are states apart (`gives`);
or as a shift of the command in time (`command_lead`)"""

LinkFilePlace = Literal["damping", "dry", "stiffness", "quadratic", "cubic", "constant"]
"""what a joint has in files of a robot's links: coefficients of q̇, sign(q̇), q, |q̇| q̇, q̇³ and 1"""


class DeclaredLoad(Enum):
    """How an effect treats the loads that are declared: payloads as weighed, external forces as measured."""

    CORRECTED = "corrected"
    """a ratio of each payload is estimated beside the effect (eq. 35), so that a wrong declaration is not taken for it"""
    TRUSTED = "trusted"
    """loads are taken as declared: the effect and the payload ratio are the same column of the load, so that one of them
    must be known; its gain still counts from the model with the ratio, if that is better"""
    QUESTIONED = "questioned"
    """the effect itself says that a declaration is wrong; it is judged against loads taken as declared"""


class Effect(ABC):
    """One physical effect of one joint, linear in its parameters once its nonlinear constants are chosen.

    A subclass states the class attributes and gives `columns`. An effect with nonlinear constants also gives
    `grid`; one that not every record can show states `conditions`.
    """

    catalogued: bool = True
    """whether it is offered to everybody; what serves one computation or one user is not"""
    name: str
    title: str = ""
    """in an operator's words, as a part of a sentence: "friction that grows with the load"; the name if not said"""
    group: str
    equation: str
    explanation: str
    """in an operator's words, ending with what to check on the machine"""
    regressors: tuple[str, ...]
    """what each column is, as a formula"""
    parameters: tuple[EffectParameter, ...]
    """of each column: name, unit, and what it can be"""
    source: str
    conditions: tuple[Condition, ...] = ()
    """what data must hold for it to be seen, the decisive ones first"""
    not_planned: str | None = None
    """why no plan can be made for a model that has it, in words; None where one can"""
    variable: str = "dq"
    """the variable over which the effect is best seen in a residual"""
    picture: PictureVariable = OVER_SPEED
    """what its picture is drawn over"""
    confusable: tuple[str, ...] = ()
    """names of effects that are the same physics, or that only special data tell apart"""
    uses_load: bool = False
    """whether the columns need the load of a fitted rigid model"""
    uses_torque: bool = False
    """whether the columns need the whole torque of a fitted model; such effects are no part of that torque"""
    known_beforehand: bool = False
    """of an effect that uses the load: whether it is only what is known of it without a fit, the weighed payloads"""
    declared_load: DeclaredLoad = DeclaredLoad.CORRECTED
    estimates_ratio: bool = False
    """whether its parameters, as fitted, are how far ratios of the load are from 1 (`reported_offset`)"""
    from_derivatives: bool = False
    """whether it lives in derivatives of the motion, where a disturbance inside the position loop shows the most"""
    from_residual: bool = False
    """whether what to search is found in what a first fit leaves (lines over position)"""
    nonlinear: bool = False
    """whether the columns depend on the acceleration other than in proportion, the load apart"""
    simulated: Simulated = "instant"
    """how a simulation forms the effect's torque, see `simulated_with`"""
    state_name: str = ""
    """what the state is, in words, where a simulation gives the effect one of its own"""
    gives: Literal["spring", "gap"] | None = None
    """what it is between motor and link, where a simulation has both as masses of their own"""
    inputs: tuple[str, ...] = ()
    """what a simulation takes from the record for it, beside what drives the motion"""
    rows: Literal["joint", "gear", "motor", "pair", "robot"] = "joint"
    """whose rows carry the columns: the joint's own; those of every joint that the joint's motor drives, in that motor's
    velocity and load ("gear": where motors share no axes that is the joint's own); the same of shared motors alone,
    the columns being of each row already ("motor"), those of the joint and the one before it, which turn one motor that no
    gain matrix declares ("pair"); or all"""
    beside: float = 0.0
    """of a pair: how the motor of the joint before it turns the shared one, 1 or -1 turn per turn"""
    rotor: int | None = None
    """which parameter is the inertia of a shared motor's rotor, a part of what that motor's gear carries"""

    in_link_files: LinkFilePlace | None = None
    """which attribute of a joint in URDF, SDF and MJCF files holds the effect exactly, if any"""
    formula_derivatives: tuple[int, ...] = ()
    """how many times each of `formulas` is differentiated with respect to time; empty where none is. Once at most where the
    columns need the whole torque, else twice at most."""
    dissipates: bool = False
    """whether it is friction: all such effects of a joint together never drive it (`admissible_values`)"""

    def explained(self, summary: JointSummary) -> str:
        """The explanation with the names of the joints that it is about."""
        return self.explanation

    @property
    def needs(self) -> tuple[str, ...]:
        """What data must hold for it to be seen, in words."""
        return tuple(condition.need for condition in self.conditions)

    def obstacle(self, summary: JointSummary) -> Obstacle | None:
        """Why a record or a plan does not show the effect; None where it does.

        Of several conditions that are not met, the first that prevents it altogether, else the first.
        """
        unmet = [obstacle for each in self.conditions if (obstacle := each.obstacle(summary))]
        return next((obstacle for obstacle in unmet if obstacle.prevents), unmet[0] if unmet else None)

    def prevented(self, summary: JointSummary) -> str | None:
        """The reason, where nothing of the effect is in the data, so that it need not be tried; else None."""
        obstacle = self.obstacle(summary)
        return obstacle.reason if obstacle and obstacle.prevents else None

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        """Values of the nonlinear constants worth trying, coarse, within their physical range."""
        return [{}]

    def refine(self, constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
        """Finer values around a choice; the choice itself is among them."""
        return [dict(constants)]

    def searched(self, summary: JointSummary) -> int:
        """How many independent values of the constants the search amounts to, for the correction of evidence."""
        return max(1, min(len(self.grid(summary)), 4))

    def parameters_of(self, summary: JointSummary, constants: Constants) -> tuple[EffectParameter, ...]:
        """The parameter of each column for this record; usually the class attribute."""
        return self.parameters

    def relations(self, summary: JointSummary, constants: Constants) -> tuple[Relation, ...]:
        """Linear relations between the parameters, as fitted, beside each one's own range."""
        return ()

    def reported_offset(self, constants: Constants) -> float:
        """What is added to the fitted values when they are reported: 1 where they are deviations of a ratio from 1."""
        return 0.0

    def of_sessions(self, constants: Constants) -> bool:
        """Whether its values are of single sessions of the record, so that it is no part of a model of the machine."""
        return False

    def assumed(self, friction: float, speed: float) -> tuple[float, ...] | None:
        """Values of the parameters that a plan takes before anything was measured; None for nothing of the effect.

        friction : N m or N, of dry friction, and again of viscous friction at the highest speed
        speed    : rad/s or m/s, the highest
        """
        return None

    def replaces_payload_ratio(self, constants: Constants) -> bool:
        """Whether a model that has it leaves no column for the payload ratio of eq. (35)."""
        return False

    def made_by_recording(self, values: Array, margins: Array, sampling_period: float) -> str | None:
        """Words where estimates (parameters,) cannot be told from what sampling itself makes, which is no fault of the machine;
        else None.

        margins         : (parameters,) how far each may be from its value; NaN where that is not known
        sampling_period : s
        """
        return None

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        """The columns as formulas of the state, for code that runs without this library; None where there are none.

        In the language of a user's own effect (`expression.py`), whose signals are joined by `direction` (sign of dq),
        `memory` (the effect's state), `load_slope` (d load / dq of the joint itself), `gravity_1` and `gravity_2` (d load /
        d gravity along the two directions that tilt it), `motor_velocity`, `motor_acceleration` and `motor_share`. What
        `formula_derivatives` says is differentiated over time. Those of a gear are of its motor where motors share axes
        (`identify.export.exported_model.of_motor`).
        """
        return None

    def command_lead(self, values: Array) -> float:
        """s by which the recorded command stands later than the motion that it made, where `simulated_with` is "command"."""
        return 0.0

    def simulated_with(self, constants: Constants) -> Simulated:
        """How a simulation forms the torque with these constants."""
        return self.simulated

    def simulated_values(self, values: Array, constants: Constants, inertia: float) -> Array:
        """(parameters,) estimates as a mechanism can have them.

        inertia : kg m² or kg, of the joint, rotor included
        """
        return values

    def impact(self, before: Array, after: Array, values: Array, constants: Constants) -> Array:
        """(windows,) kg m² or kg: inertia that a joint takes up at once where its state goes from one to the other."""
        return np.zeros(len(before))

    def state_at_start(self, direction: Array) -> Array:
        """(windows,) state of the memory where nothing is known of what was before, for directions of motion -1, 0, 1."""
        return direction.copy()

    def state_after(self, state: Array, travel: Array, constants: Constants) -> Array:
        """(windows,) state after the joint has moved on by `travel` in one direction, rad or m."""
        return state

    def states_along(self, position: Array, at_start: float, constants: Constants) -> Array:
        """(samples,) state of the memory along a course of positions of the joint, `state_after` from sample to sample."""
        return np.full(len(position), at_start)

    def stiffness_of_state(self, values: Array, constants: Constants) -> float:
        """N m/rad or N/m: the stiffest that the memory acts on the joint as a spring, for the step of a simulation."""
        return 0.0

    def columns_of_state(self, motion: JointMotion, state: Array, constants: Constants) -> Array:
        """`columns` at one instant of many windows, whose memory is in `state`, (windows, parameters)."""
        return self.columns(motion, constants)

    @abstractmethod
    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        """Columns on the rows of `motion.joint`, (samples, parameters), per unit of parameter."""


def number(value: float) -> str:
    """A constant in a formula: exact, and in brackets where it is negative."""
    return repr(float(value)) if value >= 0 else f"({float(value)!r})"


def geometric_grid(name: str, lowest: float, highest: float, count: int) -> list[dict[str, float]]:
    """`count` values of one constant in equal ratios from `lowest` to `highest`."""
    if not (lowest > 0 and highest > lowest):
        return [{name: max(lowest, highest)}]
    ratio = (highest / lowest) ** (1 / max(1, count - 1))
    return [{name: lowest * ratio**step} for step in range(count)]


def finer(name: str, constants: Constants, ratio: float, steps: int = 4) -> list[dict[str, float]]:
    """Values of one constant from 1/ratio to ratio times the present choice, the choice in the middle."""
    return [
        {**constants, name: constants[name] * ratio ** (step / steps)} for step in range(-steps, steps + 1)
    ]
