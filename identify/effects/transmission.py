"""Effects of the drive chain: elasticity, rotor inertia, friction on shared motors."""

from dataclasses import replace

import numpy as np

from identify.effects.conditions import ENCODER_ON_THE_MOTOR, SHARED_MOTOR, Condition
from identify.effects.effect import Constants, Effect
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter
from identify.effects.picture import OVER_ACCELERATION, OVER_SPEED

MOTOR_FORMULAS = (
    "motor_share * motor_velocity",
    "motor_share * sign(motor_velocity)",
    "motor_share * motor_acceleration",
)
"""of viscous and dry friction and of the rotor of a motor, as `motor_columns` has them"""
LARGEST_DEFLECTION = 0.05
"""Part of the range of motion by which link and motor can be apart, by play or by wind-up under the largest load. The columns
are of the first order in it; a large one is a torque over position or load, which springs and other effects make."""


def motor_columns(motion: JointMotion) -> Array:
    """(N, 3): viscous friction, dry friction and rotor of the motor of a motion, on the joint that it is of."""
    velocity = motion.motor_velocity
    return motion.motor_share * np.column_stack([velocity, np.sign(velocity), motion.motor_acceleration])


class Elasticity(Effect):
    name = "elasticity"
    title = "elasticity of the transmission"
    group = "memory"
    equation = "−(J/k) d²τ_out/dt² − (1/k) τ_out ∂τ_out/∂q"
    explanation = (
        "The gear or belt twists under load, so that the link lags behind the motor. "
        "Check: joint stiffness in the gear's data sheet; a loose coupling or belt; compare with a link-side encoder."
    )
    regressors = ("−d²τ_out/dt²", "−τ_out ∂τ_out/∂q")
    parameters = (
        EffectParameter("inertia_over_stiffness", "s²", lower=0.0),
        EffectParameter("compliance", "rad/(N m)", lower=0.0),
    )
    source = "Spong 1987 (flexible joints), first order in 1/k"
    conditions = (Condition("fast changes of load"), ENCODER_ON_THE_MOTOR)
    variable = "ddq"
    picture = OVER_ACCELERATION
    confusable = ("delay", "backlash")
    from_derivatives = True
    uses_load = True
    simulated = "give"
    gives = "spring"
    formula_derivatives = (2, 0)

    def parameters_of(self, summary: JointSummary, constants: Constants) -> tuple[EffectParameter, ...]:
        inertia, compliance = self.parameters
        largest = max(abs(summary.load_range[0]), abs(summary.load_range[1]), 1e-9)
        return inertia, replace(compliance, upper=LARGEST_DEFLECTION * summary.span / largest)

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return ("-load", "-load * load_slope")

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        rate = np.gradient(motion.load, motion.period)
        return np.column_stack([-np.gradient(rate, motion.period), -motion.load * motion.load_slope])


class MotorInertia(Effect):
    name = "motor-inertia"
    title = "inertia of the motor"
    group = "transmission"
    equation = "I_am ẇ_m,  w_m: velocity of a motor that several joints share"
    explanation = (
        "The rotor of a motor that several joints share turns with all of them; its inertia couples these joints. "
        "Check: nothing; it belongs to a wrist with coupled drives."
    )
    regressors = ("c_jm ẇ_m",)
    parameters = (EffectParameter("IaM", "kg m^2", lower=0.0),)
    source = "Khalil, Dombre 2002, ch. 9 (coupled drives)"
    conditions = (SHARED_MOTOR,)
    rows = "motor"
    rotor = 0
    variable = "ddq"
    picture = OVER_ACCELERATION

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return ("motor_share * motor_acceleration",)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return motion.motor_share * motion.motor_acceleration[:, None]


class MotorViscous(Effect):
    """What eq. (30) leaves of `coupled-friction`: its dry part is the equation's own, and so is the rotor in its load."""

    catalogued = False
    name = "motor-viscous"
    group = "transmission"
    equation = "F_VM w_m"
    explanation = "Viscous friction of a motor that several joints share."
    regressors = ("c_jm w_m",)
    parameters = (EffectParameter("FVM", "N m s/rad", lower=0.0),)
    source = "Gautier, Janot, Vandanjon 2013, IEEE TCST 21(2)"
    dissipates = True
    conditions = (SHARED_MOTOR,)
    rows = "motor"

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return ("motor_share * motor_velocity",)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return motion.motor_share * motion.motor_velocity[:, None]


class CoupledFriction(Effect):
    name = "coupled-friction"
    title = "friction that sits on a coupled motor"
    group = "transmission"
    equation = "F_VM w_m + F_CM sign(w_m) + I_aM ẇ_m,  w_m: velocity of a motor that several joints share"
    explanation = (
        "Friction and rotor inertia of a motor that several joints share act in that motor's velocity, not in the "
        "joint's. Check: nothing; it belongs to a wrist with coupled drives (off-diagonal drive gains)."
    )
    regressors = ("c_jm w_m", "c_jm sign(w_m)", "c_jm ẇ_m")
    parameters = (
        EffectParameter("FVM", "N m s/rad", lower=0.0),
        EffectParameter("FCM", "N m", lower=0.0),
        EffectParameter("IaM", "kg m^2", lower=0.0),
    )
    source = "Stäubli TX40 wrist: Gautier, Janot, Vandanjon 2013, IEEE TCST 21(2)"
    dissipates = True
    conditions = (SHARED_MOTOR,)
    rows = "motor"
    rotor = 2
    variable = "motor velocity"
    picture = OVER_SPEED
    confusable = ("viscous", "coulomb", "motor-inertia")

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return MOTOR_FORMULAS

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return motor_columns(motion)
