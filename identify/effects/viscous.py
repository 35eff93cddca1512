"""Friction that depends on speed alone: eq. (5) and what real machines add to it."""

import numpy as np

from identify.effects.conditions import BOTH_DIRECTIONS, FAST_MOTION, SLOW_MOTION, STRIBECK_SPEEDS
from identify.effects.effect import Constants, Effect, finer, geometric_grid, number
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter, Relation
from identify.effects.picture import OVER_SIZE_OF_SPEED, OVER_SPEED


class Viscous(Effect):
    name = "viscous"
    title = "viscous friction"
    group = "friction over speed"
    equation = "F_V q̇"
    explanation = (
        "Friction that grows in proportion to speed, as oil and grease in a gearbox give. "
        "Check: nothing; every drive has it."
    )
    regressors = ("q̇",)
    parameters = (EffectParameter("FV", "N m s/rad", lower=0.0),)
    dissipates = True
    in_link_files = "damping"
    source = "paper, eq. (5)"
    picture = OVER_SPEED
    confusable = ("viscous-power", "viscous-quadratic")

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return ("dq",)

    def assumed(self, friction: float, speed: float) -> tuple[float, ...]:
        return (friction / speed,)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return motion.dq[:, None]


class ViscousAsymmetric(Effect):
    name = "viscous-asymmetric"
    title = "viscous friction that differs between the directions"
    group = "friction over speed"
    equation = "F_Va |q̇|   (F_V+ = F_V + F_Va forwards, F_V− = F_V − F_Va backwards)"
    explanation = (
        "Viscous friction is larger in one direction than in the other, as with a preloaded screw, a lip seal or a "
        "one-sided bearing load. Check: seal and bearing preload; run at the same speed both ways and compare the current."
    )
    regressors = ("|q̇|",)
    parameters = (EffectParameter("FVa", "N m s/rad"),)
    dissipates = True
    source = "Janot, Gautier, Brunot 2019 (EMPS: the friction is asymmetric)"
    conditions = (BOTH_DIRECTIONS, FAST_MOTION)
    picture = OVER_SPEED
    confusable = ("offset",)

    def relations(self, summary: JointSummary, constants: Constants) -> tuple[Relation, ...]:
        return tuple(
            Relation(
                {(Viscous.name, 0): 1.0, (self.name, 0): sign},
                0.0,
                f"F_V{way} ≥ 0: viscous friction never drives",
            )
            for way, sign in (("+", 1.0), ("−", -1.0))
        )

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return ("abs(dq)",)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return np.abs(motion.dq)[:, None]


class ViscousQuadratic(Effect):
    name = "viscous-quadratic"
    title = "friction that grows with the square of the speed"
    group = "friction over speed"
    equation = "F_V2 |q̇| q̇"
    explanation = (
        "Friction that grows with the square of speed (churning oil, a fan, turbulent flow) or, with a negative sign, "
        "levels off. Check: oil level and fill of the gearbox; drag of hoses and covers at speed."
    )
    regressors = ("|q̇| q̇",)
    parameters = (EffectParameter("FV2_", "N m s²/rad²"),)  # either sign: churning, or levelling off
    dissipates = True
    in_link_files = "quadratic"
    source = "Armstrong-Hélouvy 1991, ch. 2"
    conditions = (FAST_MOTION,)
    picture = OVER_SIZE_OF_SPEED
    confusable = ("viscous-cubic", "viscous-power")

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return ("abs(dq) * dq",)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return (np.abs(motion.dq) * motion.dq)[:, None]


class ViscousCubic(Effect):
    name = "viscous-cubic"
    title = "friction that grows with the cube of the speed"
    group = "friction over speed"
    equation = "F_V3 q̇³"
    explanation = (
        "Friction that departs from a straight line with the third power of speed. "
        "Check: lubricant (shear-thinning grease) and temperature; look at the friction curve over speed."
    )
    regressors = ("q̇³",)
    parameters = (EffectParameter("FV3_", "N m s³/rad³"),)  # either sign, as above
    dissipates = True
    in_link_files = "cubic"
    source = "Hao, Pagani, Beschi, Legnani 2021, Robotics 10(1), 49 (polynomial friction)"
    conditions = (FAST_MOTION,)
    picture = OVER_SIZE_OF_SPEED
    confusable = ("viscous-quadratic", "viscous-power")

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return ("dq ** 3",)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return (motion.dq**3)[:, None]


class ViscousPower(Effect):
    name = "viscous-power"
    title = "friction that rises less than linearly with speed"
    group = "friction over speed"
    equation = "F_p |q̇|^p sign(q̇),  0 < p < 1"
    explanation = (
        "Friction rises less than in proportion to speed: much at first, less later, as shear-thinning grease in "
        "harmonic drives and cycloidal gears does. Check: grease type and temperature; nothing is broken."
    )
    regressors = ("|q̇|^p sign(q̇)",)
    parameters = (EffectParameter("FP", "N m (s/rad)^p", lower=0.0),)
    dissipates = True
    source = "Wahrburg et al. 2018, Mechatronics (speed-power friction of robot gears); measured on the TX40"
    conditions = (FAST_MOTION, SLOW_MOTION)
    picture = OVER_SIZE_OF_SPEED
    confusable = ("viscous-quadratic", "viscous-cubic", "stribeck")

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        return [{"exponent": exponent} for exponent in (0.2, 0.35, 0.5, 0.65, 0.8)]

    def refine(self, constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
        present = constants["exponent"]
        return [
            {"exponent": value}
            for value in np.round(np.linspace(present - 0.1, present + 0.1, 9), 4)
            if value > 0
        ]

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return (f"direction * abs(dq) ** {number(constants['exponent'])}",)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return (motion.direction * np.abs(motion.dq) ** constants["exponent"])[:, None]


class Stribeck(Effect):
    name = "stribeck"
    title = "friction that falls as the joint begins to slide (Stribeck)"
    group = "dry friction"
    equation = "F_s exp(−|q̇|/q̇_s) sign(q̇)"
    explanation = (
        "Dry friction is larger at very low speed and falls as the lubricant film builds up. It makes slow motion jerk. "
        "Check: lubrication; run slow ramps and look for stick-slip."
    )
    regressors = ("exp(−|q̇|/q̇_s) sign(q̇)",)
    parameters = (EffectParameter("FS", "N m", lower=0.0),)  # stiction is more than sliding friction
    dissipates = True
    rows = "gear"
    source = "paper, eq. (22)"
    conditions = (STRIBECK_SPEEDS,)
    picture = OVER_SIZE_OF_SPEED
    confusable = ("presliding", "viscous-power")

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        lowest, highest = stribeck_range(summary)
        return geometric_grid("stribeck_velocity", lowest, highest, 9)

    def refine(self, constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
        return finer_stribeck(constants, summary, stribeck_step(summary, 9))

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return (f"direction * {fading(constants)}",)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return (motion.direction * np.exp(-np.abs(motion.dq) / constants["stribeck_velocity"]))[:, None]


def fading(constants: Constants) -> str:
    """exp(−|q̇|/q̇_s) as a formula."""
    return f"exp(-abs(dq) / {number(constants['stribeck_velocity'])})"


def stribeck_range(summary: JointSummary) -> tuple[float, float]:
    """Range of q̇_s worth searching, rad/s: from what encoder and motion show to a fifth of the top speed.

    What fades below the slowest speeds driven is seen at reversals only, beside what is left of stops there.
    """
    highest = 0.2 * summary.maximum_speed
    slowest = 0.5 * float(summary.speed_quantiles[1])
    lowest = max(2.0 * summary.speed_resolution, 0.003 * summary.maximum_speed, slowest)
    return min(lowest, 0.5 * highest), highest


def finer_stribeck(
    constants: Constants, summary: JointSummary, ratio: float, steps: int = 4
) -> list[dict[str, float]]:
    """Values of q̇_s around a choice that stay within the range worth searching."""
    lowest, highest = stribeck_range(summary)
    values = {
        min(max(choice["stribeck_velocity"], lowest), 5 * highest)
        for choice in finer("stribeck_velocity", constants, ratio, steps)
    }
    return [{**constants, "stribeck_velocity": value} for value in sorted(values)]


def stribeck_step(summary: JointSummary, count: int) -> float:
    """Ratio between neighbours of the coarse grid of q̇_s."""
    lowest, highest = stribeck_range(summary)
    return (highest / lowest) ** (1 / (count - 1))
