"""Dry friction: constant, load-dependent, and what it depends on besides."""

import numpy as np

from identify.effects.conditions import (
    ALL_QUADRANTS,
    LOAD_CHANGE,
    LOAD_CHANGE_AT_LOW_SPEED,
    LONG_SESSION,
    STRIBECK_SPEEDS,
    TEMPERATURE,
    WIDE_RANGE,
    Condition,
)
from identify.effects.effect import Constants, DeclaredLoad, Effect, finer, geometric_grid, number
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter
from identify.effects.picture import (
    LOSS_OVER_LOAD,
    LOSS_OVER_POSITION,
    OVER_SIZE_OF_SPEED,
    OVER_SPEED,
    OVER_TEMPERATURE,
    OVER_TIME,
)
from identify.effects.viscous import fading, finer_stribeck, stribeck_range, stribeck_step

ROTOR_SHARES = (0.0, 0.3, 0.6, 0.9)
"""Parts of a joint's own inertia that may be its rotor's."""


class Coulomb(Effect):
    name = "coulomb"
    title = "dry friction"
    group = "dry friction"
    equation = "F_C sign(q̇)"
    explanation = "Constant dry friction against the motion. Check: nothing; every drive has it."
    regressors = ("sign(q̇)",)
    parameters = (EffectParameter("FC", "N m", lower=0.0),)
    dissipates = True
    in_link_files = "dry"
    source = "paper, eq. (5)"
    picture = OVER_SPEED

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return ("direction",)

    def assumed(self, friction: float, speed: float) -> tuple[float, ...]:
        return (friction,)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return motion.direction[:, None]


class Offset(Effect):
    name = "offset"
    title = "an offset of the torque"
    group = "actuation"
    equation = "τ_off"
    explanation = (
        "A constant torque: the amplifier's offset and dry friction that differs between the directions. "
        "Check: offset calibration of the current amplifier."
    )
    regressors = ("1",)
    parameters = (EffectParameter("offset", "N m"),)
    source = "paper, eq. (6)"
    picture = OVER_SPEED
    confusable = ("viscous-asymmetric",)
    in_link_files = "constant"

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return ("1.0",)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return np.ones((len(motion.q), 1))


def quadrants(load: Array, direction: Array) -> tuple[Array, Array]:
    """P⁺ and P⁻ of eq. (27)-(28), with the power sign of the model's own load."""
    power_sign = np.sign(load) * direction
    return 0.5 * (1 + power_sign), 0.5 * (1 - power_sign)


def quadrant_directions(load: Array, direction: Array) -> tuple[Array, Array]:
    """P⁺ sign(dq) and P⁻ sign(dq).

    Their sum is the direction and their difference the load's sign also where a reversal makes the direction a mean
    of both: eq. (30) keeps the dependences between its columns, none is fitted to what the reversal leaves of one.
    """
    sign = np.sign(load)
    return 0.5 * (direction + sign), 0.5 * (direction - sign)


def gear_load(constants: Constants) -> str:
    """What the gear carries as a formula: the load less what turns the rotor (`JointMotion.gear_load`)."""
    return f"(load - {number(constants['rotor_inertia'])} * ddq)"


def rotor_grid(summary: JointSummary) -> list[dict[str, float]]:
    """Rotor inertias worth trying: the rotor's share of a geared joint's inertia is anything from none to most.

    Identification cannot tell it from the link's (they are one base parameter), but the gear does not carry it.
    """
    shares = ROTOR_SHARES if summary.own_inertia > 0 else (0.0,)
    return [{"rotor_inertia": share * summary.own_inertia} for share in shares]


def finer_rotor(constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
    """Rotor inertias around a choice, within the joint's own inertia."""
    present = constants["rotor_inertia"]
    step = 0.08 * max(summary.own_inertia, present)
    values = {max(0.0, present + step * k) for k in range(-2, 3)}
    return [{**constants, "rotor_inertia": value} for value in sorted(values)]


class LoadFriction(Effect):
    name = "load-friction"
    title = "friction that grows with the load"
    group = "load"
    equation = "α |τ_out| sign(q̇)"
    explanation = (
        "Dry friction grows with the load that the gear carries, as Coulomb's law says. Worm gears, screws and "
        "cycloidal reducers show it most. Check: compare friction with and without payload at the same speed."
    )
    regressors = ("|τ_out| sign(q̇)",)
    parameters = (EffectParameter("alpha", "1", lower=0.0),)
    dissipates = True
    rows = "gear"
    source = "paper, eq. (18)"
    conditions = (LOAD_CHANGE,)
    variable = "load"
    picture = LOSS_OVER_LOAD
    confusable = ("load-friction-asymmetric", "friction-position")
    uses_load = True
    declared_load = DeclaredLoad.TRUSTED

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        return rotor_grid(summary)

    def refine(self, constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
        return finer_rotor(constants, summary)

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return (f"abs({gear_load(constants)}) * direction",)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return (np.abs(motion.gear_load(constants["rotor_inertia"])) * motion.direction)[:, None]


class LoadFrictionAsymmetric(Effect):
    name = "load-friction-asymmetric"
    title = "friction that grows with the load, more when driving than when driven"
    group = "load"
    equation = "(P⁺ α_m + P⁻ α_g) |τ_out| sign(q̇) + ½(β_m − β_g) sign(τ_out)"
    explanation = (
        "Dry friction grows with the load, and differently when the motor drives the load and when the load drives the "
        "motor (gear efficiency is not the same both ways). Check: reducer type and efficiency; lift and lower the same "
        "payload at the same speed and compare the currents."
    )
    regressors = ("P⁺ |τ_out| sign(q̇)", "P⁻ |τ_out| sign(q̇)", "½ sign(τ_out)")
    # α_m = a_m − 1 and α_g = 1 − a_g: both are losses. α_g above 1 is a gear that locks itself. The difference has
    # either sign; that F_C ± ½ of it stays a loss is what `dissipates` says.
    parameters = (
        EffectParameter("alpha_m", "1", lower=0.0),
        EffectParameter("alpha_g", "1", lower=0.0),
        EffectParameter("beta_difference", "N m"),
    )
    dissipates = True
    rows = "gear"
    source = "paper, eq. (20)"
    conditions = (LOAD_CHANGE, ALL_QUADRANTS)
    variable = "load"
    picture = LOSS_OVER_LOAD
    confusable = ("load-friction", "drive-gain")
    uses_load = True
    declared_load = DeclaredLoad.TRUSTED

    def replaces_payload_ratio(self, constants: Constants) -> bool:
        return True

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        return rotor_grid(summary)

    def refine(self, constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
        return finer_rotor(constants, summary)

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        load = gear_load(constants)
        ahead, back = (f"0.5 * (direction {sign} sign({load})) * abs({load})" for sign in "+-")
        return ahead, back, f"0.5 * sign({load})"

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        load = motion.gear_load(constants["rotor_inertia"])
        driving, driven = quadrant_directions(load, motion.direction)
        return np.column_stack([driving * np.abs(load), driven * np.abs(load), 0.5 * np.sign(load)])


class LoadStribeck(Effect):
    name = "load-stribeck"
    title = "friction that depends on load and speed together"
    group = "load"
    equation = "(P⁺ b_m + P⁻ b_g) |τ_out| exp(−|q̇|/q̇_s) sign(q̇)"
    explanation = (
        "The part of dry friction that grows with the load changes at low speed (the load squeezes the lubricant film "
        "out). Check: lubrication under load; slow motion with the heaviest payload."
    )
    regressors = ("P⁺ |τ_out| exp(−|q̇|/q̇_s) sign(q̇)", "P⁻ |τ_out| exp(−|q̇|/q̇_s) sign(q̇)")
    # eq. (24): stiction's share of the load less sliding's
    parameters = (EffectParameter("b_m", "1", lower=0.0), EffectParameter("b_g", "1", lower=0.0))
    dissipates = True
    rows = "gear"
    source = "paper, eq. (24)-(25)"
    conditions = (LOAD_CHANGE_AT_LOW_SPEED, STRIBECK_SPEEDS, ALL_QUADRANTS)
    variable = "dq"
    picture = OVER_SIZE_OF_SPEED
    confusable = ("stribeck", "load-friction-asymmetric")
    uses_load = True

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        velocities = geometric_grid("stribeck_velocity", *stribeck_range(summary), 7)
        return [{**velocity, **rotor} for velocity in velocities for rotor in rotor_grid(summary)[::2]]

    def refine(self, constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
        velocities = finer_stribeck(constants, summary, stribeck_step(summary, 7), 3)
        return [
            {**velocity, **rotor} for velocity in velocities for rotor in finer_rotor(velocity, summary)[::2]
        ]

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        load = gear_load(constants)
        ahead, back = (f"0.5 * (direction {sign} sign({load})) * abs({load})" for sign in "+-")
        return f"{ahead} * {fading(constants)}", f"{back} * {fading(constants)}"

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        load = motion.gear_load(constants["rotor_inertia"])
        driving, driven = quadrant_directions(load, motion.direction)
        fading = np.abs(load) * np.exp(-np.abs(motion.dq) / constants["stribeck_velocity"])
        return np.column_stack([driving * fading, driven * fading])


class FrictionPosition(Effect):
    name = "friction-position"
    title = "friction that varies with the position"
    group = "position"
    equation = "(Σ_k F_k B_k(q)) sign(q̇),  B_k: hat functions over the range of motion"
    explanation = (
        "Dry friction is not the same everywhere: a tight spot, a bent shaft, a worn or dry stretch of the gear. "
        "Check: turn the joint slowly by hand or at low speed and feel for tight spots; look at the bearing there."
    )
    regressors = ("B_k(q) sign(q̇)",)
    parameters = (EffectParameter("FQ", "N m"),)  # more or less than at the lower end of the range
    dissipates = True
    source = "Armstrong-Hélouvy 1991, ch. 3 (position-dependent friction)"
    conditions = (WIDE_RANGE, Condition("motion over the same positions in both directions"))
    variable = "q"
    picture = LOSS_OVER_POSITION
    confusable = ("load-friction", "torque-ripple")

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        low, high = summary.position_range
        return [{"from": low, "to": high, "knots": knots} for knots in (3.0, 5.0, 8.0, 13.0)]

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        low, high, count = constants["from"], constants["to"], round(constants["knots"])
        width = (high - low) / (count - 1)
        place = f"min(max(q, {number(low)}), {number(high)})"
        return tuple(
            f"direction * max(0.0, 1.0 - abs({place} - {number(low + knot * width)}) / {number(width)})"
            for knot in range(1, count)
        )

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return hat_functions(motion.q, constants)[:, 1:] * motion.direction[:, None]


def hat_functions(position: Array, constants: Constants) -> Array:
    """Piecewise linear hat functions over the range of motion, (samples, knots); they sum to one."""
    knots = np.linspace(constants["from"], constants["to"], round(constants["knots"]))
    width = knots[1] - knots[0]
    clipped = np.clip(position, knots[0], knots[-1])
    return np.maximum(0.0, 1.0 - np.abs(clipped[:, None] - knots) / width)


class FrictionTemperature(Effect):
    name = "friction-temperature"
    title = "friction that varies with the temperature"
    group = "temperature"
    equation = "(T − 20 °C) (F_VT q̇ + F_CT sign(q̇))"
    explanation = (
        "Friction changes with the temperature of the gearbox. Check: warm the machine up before measuring, or keep the "
        "temperature column in every session."
    )
    regressors = ("(T − 20) q̇", "(T − 20) sign(q̇)")
    # oil thins and seals stiffen as they will: either sign
    parameters = (EffectParameter("FVT", "N m s/(rad K)"), EffectParameter("FCT", "N m/K"))
    dissipates = True
    source = "Bittencourt, Axelsson 2014, IEEE/ASME Trans. Mechatronics 19(1)"
    conditions = (TEMPERATURE,)
    not_planned = "a plan does not say how warm the gearbox will be"
    variable = "temperature"
    inputs = ("temperature",)
    picture = OVER_TEMPERATURE
    confusable = ("friction-warmup",)

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return "(temp - 20.0) * dq", "(temp - 20.0) * direction"

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        assert motion.temperature is not None
        warmer = motion.temperature - 20.0
        return np.column_stack([warmer * motion.dq, warmer * motion.direction])


class FrictionWarmup(Effect):
    name = "friction-warmup"
    title = "friction that falls while the joint warms up"
    group = "temperature"
    equation = "exp(−t/T_w) (F_Vw q̇ + F_Cw sign(q̇)),  t: since the session (or the first session) began"
    explanation = (
        "Friction falls while the machine warms up. Check: warm up before measuring, measure longer, or record the "
        "gearbox temperature."
    )
    regressors = ("exp(−t/T_w) q̇", "exp(−t/T_w) sign(q̇)")
    # what fades is more friction when cold, not less
    parameters = (EffectParameter("FVw", "N m s/rad", lower=0.0), EffectParameter("FCw", "N m", lower=0.0))
    dissipates = True
    source = "Simoni, Beschi, Legnani, Visioli 2015 (friction with thermal state)"
    conditions = (LONG_SESSION,)
    variable = "time"
    inputs = ("time",)
    picture = OVER_TIME
    confusable = ("friction-temperature",)

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        longest = max(summary.session_durations)
        total = sum(summary.session_durations)
        per_session = geometric_grid("time_constant", 0.1 * longest, 2.0 * longest, 4)
        choices = [{**value, "across_sessions": 0.0} for value in per_session]
        if len(summary.session_durations) > 1:
            across = geometric_grid("time_constant", 0.15 * total, 1.5 * total, 3)
            choices += [{**value, "across_sessions": 1.0} for value in across]
        return choices

    def refine(self, constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
        return finer("time_constant", constants, 2.0)

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        cold = f"exp(-t / {number(constants['time_constant'])})"
        return f"{cold} * dq", f"{cold} * direction"

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        clock = motion.experiment_time if constants["across_sessions"] else motion.session_time
        cold = np.exp(-clock / constants["time_constant"])
        return np.column_stack([cold * motion.dq, cold * motion.direction])
