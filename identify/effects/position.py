"""Torques that depend on where the joint stands: springs and ripple."""

import numpy as np

from identify.effects.conditions import SLOW_MOTION, WIDE_RANGE, Condition, Obstacle
from identify.effects.effect import Constants, Effect, number
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter
from identify.effects.picture import OVER_POSITION

SLOW_OVER_CYCLES = Condition("slow motion over several cycles", SLOW_MOTION.obstacle)
PERIOD_FROM_RECORD = "its period is found in a record; take slow motion over a wide range, then identify"


def _no_line(lines: tuple[float, ...] | None) -> Obstacle | None:
    """Nothing to say before a first fit has been looked at."""
    if lines is None or lines:
        return None
    return Obstacle("no line stands out in the residual over position", "take slow motion over a wide range")


LINES_OVER_POSITION = Condition(
    "an error that repeats with position", lambda summary: _no_line(summary.position_lines)
)
LINES_OVER_LOAD = Condition(
    "an error that repeats with position", lambda summary: _no_line(summary.load_lines)
)


class JointSpring(Effect):
    name = "joint-spring"
    title = "a spring at the joint"
    group = "position"
    equation = "k_s q"
    explanation = (
        "A torque that grows with the joint's angle: a balancing spring, a gas strut, a stiff cable or hose that was not "
        "in the model. Check: look for a spring or strut on this joint; push hoses and cables aside and repeat."
    )
    regressors = ("q",)
    # a spring resists; a balancer that pulls over the centre is a first moment, which the base parameters hold
    parameters = (EffectParameter("KS", "N m/rad", lower=0.0),)
    in_link_files = "stiffness"
    source = "Khalil, Dombre 2002, ch. 9 (balancing springs)"
    conditions = (WIDE_RANGE,)
    variable = "q"
    picture = OVER_POSITION
    confusable = ("gravity-tilt",)

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return ("q",)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return motion.q[:, None]


class TorqueRipple(Effect):
    name = "torque-ripple"
    title = "torque ripple that repeats with the motor's turn"
    group = "position"
    equation = "A cos(k q) + B sin(k q)"
    explanation = (
        "A torque that repeats with position at a fixed number of cycles per turn: cogging of the motor, meshing teeth, "
        "the wave generator of a harmonic drive. Check: compare the cycles per turn with motor poles, teeth and gear ratio."
    )
    regressors = ("cos(k q)", "sin(k q)")
    parameters = (EffectParameter("ripple_cos", "N m"), EffectParameter("ripple_sin", "N m"))
    source = "Gandhi, Ghorbel, Dabney 2002 (harmonic drives); motor cogging"
    conditions = (LINES_OVER_POSITION, SLOW_OVER_CYCLES)
    not_planned = PERIOD_FROM_RECORD
    variable = "q"
    from_residual = True
    picture = OVER_POSITION
    confusable = ("current-ripple", "friction-position")

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        lines = summary.position_lines
        if not lines:
            return []
        return [{"wave_number": line} for line in lines] + [
            {"wave_number": lines[0], "second_wave_number": other}
            for other in lines[1:]
            if abs(other - lines[0]) > summary.line_width
        ]

    def refine(self, constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
        return finer_line(constants, summary)

    def searched(self, summary: JointSummary) -> int:
        return summary.lines_searched

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        listed = [value for _, value in sorted(constants.items(), reverse=True)]
        return tuple(f"{wave}({number(value)} * q)" for value in listed for wave in ("cos", "sin"))

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        phases = [number * motion.q for _, number in sorted(constants.items(), reverse=True)]
        return np.column_stack([wave(phase) for phase in phases for wave in (np.cos, np.sin)])


class CurrentRipple(Effect):
    name = "current-ripple"
    title = "torque ripple that grows with the current"
    group = "actuation"
    equation = "τ (A cos(k q) + B sin(k q)),  τ: the model's own torque"
    explanation = (
        "The torque per ampere varies with the motor's angle: a wrong commutation offset, an unbalanced current sensor, "
        "torque-constant ripple. Check: commutation calibration; offsets and gains of the phase-current sensors."
    )
    regressors = ("τ cos(k q)", "τ sin(k q)")
    # the torque per ampere keeps its sign over a turn
    parameters = (
        EffectParameter("ripple_gain_cos", "1", lower=-1.0, upper=1.0),
        EffectParameter("ripple_gain_sin", "1", lower=-1.0, upper=1.0),
    )
    source = "Armstrong, Khatib, Burdick 1986 (torque ripple of geared motors)"
    conditions = (LINES_OVER_LOAD, SLOW_OVER_CYCLES, Condition("different loads"))
    not_planned = PERIOD_FROM_RECORD
    variable = "q"
    from_residual = True
    picture = OVER_POSITION
    confusable = ("torque-ripple",)
    uses_load = True
    uses_torque = True

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        return [{"wave_number": line} for line in summary.load_lines or ()]

    def refine(self, constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
        return finer_line(constants, summary)

    def searched(self, summary: JointSummary) -> int:
        return summary.lines_searched

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        phase = f"{number(constants['wave_number'])} * q"
        return f"torque * cos({phase})", f"torque * sin({phase})"

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        phase = constants["wave_number"] * motion.q
        return np.column_stack([motion.model_torque * np.cos(phase), motion.model_torque * np.sin(phase)])


def finer_line(constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
    """Wave numbers within one resolution cell (2π over the range of motion) around a choice."""
    cell = 2 * np.pi / max(summary.span, 1e-12)
    return [{**constants, "wave_number": constants["wave_number"] + cell * step / 8} for step in range(-4, 5)]
