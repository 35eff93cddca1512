"""Effects that remember where the joint came from: presliding and backlash."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.effects.conditions import ENCODER_ON_THE_MOTOR, SLOW_MOTION, Condition
from identify.effects.dry_friction import (
    Coulomb,
    LoadFriction,
    LoadFrictionAsymmetric,
    finer_rotor,
    rotor_grid,
)
from identify.effects.effect import Constants, Effect, Simulated, finer, geometric_grid, number
from identify.effects.give import LEAST_SHARE
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter, Relation
from identify.effects.picture import AROUND_REVERSALS, OVER_TRAVEL
from identify.effects.transmission import LARGEST_DEFLECTION
from identify.effects.viscous import Stribeck


class Presliding(Effect):
    name = "presliding"
    title = "elastic give before the joint slides (presliding)"
    group = "memory"
    equation = "F_p (z − sign(q̇)),  dz/dq = (1 − z sign(q̇)) / δ"
    explanation = (
        "After each reversal friction builds up over a short way, like a stiff spring, before the joint really slides. "
        "Check: nothing is broken; it is the elastic contact of bearings and seals. It matters for short and slow moves."
    )
    regressors = ("z − sign(q̇)",)
    parameters = (EffectParameter("FP_", "N m", lower=0.0),)
    source = "Dahl 1968; Canudas de Wit et al. 1995 (LuGre without the velocity term)"
    conditions = (SLOW_MOTION, Condition("many reversals"))
    variable = "travel since reversal"
    picture = OVER_TRAVEL
    confusable = ("stribeck", "backlash")
    simulated = "state"
    state_name = "share of the dry friction that has built up since the reversal"

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        lowest = max(3.0 * summary.position_resolution, 3e-4 * summary.span)
        return geometric_grid("presliding_distance", lowest, 0.08 * summary.span, 7)

    def refine(self, constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
        return finer("presliding_distance", constants, 2.0)

    def relations(self, summary: JointSummary, constants: Constants) -> tuple[Relation, ...]:
        largest = max(abs(summary.load_range[0]), abs(summary.load_range[1]))
        level = {
            (Coulomb.name, 0): 1.0,
            (Stribeck.name, 0): 1.0,
            (LoadFriction.name, 0): largest,
            (LoadFrictionAsymmetric.name, 0): largest,
            (self.name, 0): -1.0,
        }
        return (
            Relation(level, 0.0, "no more friction builds up after a reversal than there is dry friction"),
        )

    def state_after(self, state: Array, travel: Array, constants: Constants) -> Array:
        heading = np.sign(travel)
        fading = np.exp(-np.abs(travel) / constants["presliding_distance"])
        return np.where(heading == 0.0, state, heading + (state - heading) * fading)

    def stiffness_of_state(self, values: Array, constants: Constants) -> float:
        return 2.0 * abs(float(values[0])) / constants["presliding_distance"]

    def columns_of_state(self, motion: JointMotion, state: Array, constants: Constants) -> Array:
        return (state - motion.direction)[:, None]

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return ("memory - direction",)

    def states_along(self, position: Array, at_start: float, constants: Constants) -> Array:
        return built_up(position, at_start, constants["presliding_distance"])

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return (remembered(self, motion, constants) - motion.direction)[:, None]


class Backlash(Effect):
    name = "backlash"
    title = "play between motor and joint (backlash)"
    group = "memory"
    equation = (
        "a ∂τ_out/∂q s − c s̈;  s: the link's place in the gap, pushed by motion (play) or by load (flank)"
    )
    explanation = (
        "The motor turns a little way before the link follows: play in the gear. "
        "Check: hold the motor with its brake and move the link by hand; look at gear wear and preload."
    )
    regressors = ("∂τ_out/∂q s", "−s̈")
    # The motor's encoder sees q, the link stands at q + b s with the gap b ≥ 0: τ_out(q + b s) = τ_out + b s ∂τ_out/∂q
    # + J b s̈ in first order, so that a = b and c = −J b.
    parameters = (
        EffectParameter("backlash_gravity", "rad", lower=0.0),
        EffectParameter("backlash_inertia", "kg m^2 rad", upper=0.0),
    )
    source = "Nordin, Gutman 2002, Automatica 38 (mechanical systems with backlash)"
    conditions = (Condition("reversals of motion and of load"), ENCODER_ON_THE_MOTOR)
    variable = "load"
    picture = AROUND_REVERSALS
    confusable = ("presliding", "elasticity")
    from_derivatives = True
    uses_load = True
    state_name = "the link's place in the gap"
    gives = "gap"
    formula_derivatives = (0, 2)

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        lowest = max(4.0 * summary.position_resolution, 5e-4 * summary.span)
        play = geometric_grid("play", lowest, LARGEST_DEFLECTION * summary.span, 4)
        largest = max(abs(summary.load_range[0]), abs(summary.load_range[1]), 1e-9)
        flank = geometric_grid("flank_load", 0.02 * largest, 0.3 * largest, 4)
        return play + [{**place, **rotor} for place in flank for rotor in rotor_grid(summary)[:3]]

    def parameters_of(self, summary: JointSummary, constants: Constants) -> tuple[EffectParameter, ...]:
        gap, inertia = self.parameters
        return replace(gap, upper=LARGEST_DEFLECTION * summary.span), inertia

    def refine(self, constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
        if "play" in constants:
            return finer("play", constants, 2.0)
        places = finer("flank_load", constants, 1.8, 2)
        return [{**place, **rotor} for place in places for rotor in finer_rotor(place, summary)[::2]]

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        place = "memory"
        if "play" not in constants:
            carried = f"(load - {number(constants['rotor_inertia'])} * ddq)"
            place = f"(-0.5 * tanh({carried} / {number(constants['flank_load'])}))"
        return (f"load_slope * {place}", f"-{place}")

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        if "play" in constants:
            place = remembered(self, motion, constants)
        else:
            place = -0.5 * np.tanh(motion.gear_load(constants["rotor_inertia"]) / constants["flank_load"])
        rate = np.gradient(place, motion.period)
        return np.column_stack([motion.load_slope * place, -np.gradient(rate, motion.period)])

    def simulated_with(self, constants: Constants) -> Simulated:
        """Pushed by motion the link's place is a state; pushed by load it gives way between motor and link."""
        return "state" if "play" in constants else "give"

    def simulated_values(self, values: Array, constants: Constants, inertia: float) -> Array:
        if "play" not in constants:
            return values
        # within the gap the motor moves alone, and it has an inertia
        least = -(1.0 - LEAST_SHARE) * max(0.0, inertia) * constants["play"]
        return np.array([values[0], np.clip(values[1], least, 0.0)])

    def state_at_start(self, direction: Array) -> Array:
        return -0.5 * direction

    def state_after(self, state: Array, travel: Array, constants: Constants) -> Array:
        return np.clip(state - travel / constants["play"], -0.5, 0.5)

    def states_along(self, position: Array, at_start: float, constants: Constants) -> Array:
        return place_in_gap(position, at_start, constants["play"])

    def columns_of_state(self, motion: JointMotion, state: Array, constants: Constants) -> Array:
        # the link rests while the motor crosses the gap, where s̈ = −q̈/play
        crossing = state * motion.direction > -0.5
        return np.column_stack(
            [motion.load_slope * state, np.where(crossing, motion.ddq / constants["play"], 0.0)]
        )

    def impact(self, before: Array, after: Array, values: Array, constants: Constants) -> Array:
        met = (np.abs(after) == 0.5) & (after != before)
        return np.where(met, -float(values[1]) / constants["play"], 0.0)


def remembered(effect: Effect, motion: JointMotion, constants: Constants) -> Array:
    """(samples,) state of an effect's memory along a block of motion, going on from the block before it.

    It follows from the positions alone. The direction, which turns where the recorded positions do, is another thing near a
    reversal, and no exported file has it.
    """
    key = (effect.name, motion.joint, *constants.items())
    kept = motion.memory.recall(key, float(motion.time[0]))
    first = effect.state_at_start(np.sign(motion.direction[:1]))[0] if kept is None else kept
    states = effect.states_along(motion.q, float(first), constants)
    motion.memory.keep(key, motion.time, states)
    return states


def monotone_pieces(position: Array) -> tuple[NDArray[np.intp], Array, Array]:
    """Cut a course of positions where they turn round.

    Returns the piece of every sample (samples,), and the direction and first position of every piece; a sample is of the
    piece that leads to it.
    """
    direction = np.sign(np.diff(position, prepend=position[:1]))
    moving = direction != 0
    if not moving.any():
        return np.zeros(len(position), np.intp), np.ones(1), position[:1]
    latest = np.maximum.accumulate(np.where(moving, np.arange(len(position)), np.argmax(moving)))
    direction = direction[latest]
    starts = np.flatnonzero(np.diff(direction)) + 1
    piece = np.zeros(len(position), np.intp)
    piece[starts] = 1
    beginnings = np.concatenate([[0], starts - 1])
    return np.cumsum(piece), direction[np.concatenate([[0], starts])], position[beginnings]


def built_up(position: Array, at_start: float, distance: float) -> Array:
    """(samples,) state z of Dahl's model, -1..1, exact between reversals: z = s + (z0 - s) exp(-|q - q0|/distance)."""
    piece, direction, origin = monotone_pieces(position)
    travelled = np.exp(-np.abs(np.diff(np.append(origin, position[-1]))) / distance)
    begun = np.empty(len(direction))
    value = at_start
    for index, (heading, fraction) in enumerate(zip(direction, travelled, strict=True)):
        begun[index] = value
        value = heading + (value - heading) * fraction
    heading = direction[piece]
    return heading + (begun[piece] - heading) * np.exp(-np.abs(position - origin[piece]) / distance)


def place_in_gap(position: Array, at_start: float, width: float) -> Array:
    """(samples,) place of a link in a gap of `width` (rad), in parts of it, -1/2 to 1/2, pushed by the motor at either flank."""
    piece, _, origin = monotone_pieces(position)
    travelled = np.diff(np.append(origin, position[-1])) / width
    begun = np.empty(len(origin))
    value = at_start
    for index, travel in enumerate(travelled):
        begun[index] = value
        value = min(max(value - travel, -0.5), 0.5)
    return np.clip(begun[piece] - (position - origin[piece]) / width, -0.5, 0.5)
