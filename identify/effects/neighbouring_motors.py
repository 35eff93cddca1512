"""A motor or belt that two neighbouring joints share without a gain matrix that says so: it turns with the sum or the difference
of their motors' speeds."""

from identify.effects.conditions import JOINT_BEFORE
from identify.effects.effect import Constants, Effect
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter
from identify.effects.picture import OVER_SPEED
from identify.effects.transmission import MOTOR_FORMULAS, motor_columns


class SharedMotorSum(Effect):
    """The joint's motor, and the one before it, turn one more: w = q̇ + r q̇_before, r the ratio of their gears.

    By power balance its torque acts on both joints as it turns with them. With constants {"rotor": 1} it has a rotor of its
    own; of joints with parallel axes the links say the same as that.
    """

    name = "shared-motor-sum"
    title = "friction of a motor or belt that turns with the sum of two joints' speeds"
    group = "transmission"
    equation = "F_VS w + F_CS sign(w) + I_aS ẇ,  w = q̇ + (k_before/k) q̇_before,  k: motor turns per turn of the joint"
    explanation = (
        "It looks like a shared motor or belt between the joint and the one before it: friction acts in the sum of the two "
        "motors' speeds, not in the joint's own. Check: how the two joints are driven (differential, crossed belts, a motor "
        "that sits before both); if motors are shared, the drive gain matrix in the rig file."
    )
    regressors = ("c_j w", "c_j sign(w)", "c_j ẇ")
    parameters = (
        EffectParameter("FVS", "N m s/rad", lower=0.0),
        EffectParameter("FCS", "N m", lower=0.0),
        EffectParameter("IaS", "kg m^2", lower=0.0),
    )
    source = "Khalil, Dombre 2002, ch. 9 (coupled drives); of belts Sollmann, Jouaneh, Lavender 2010, IEEE/ASME T-Mech 15(6)"
    dissipates = True
    conditions = (JOINT_BEFORE,)
    rows = "pair"
    beside = 1.0
    variable = "motor velocity"
    picture = OVER_SPEED
    confusable = ("shared-motor-difference", "coupled-friction")

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        return [{"rotor": 0.0}, {"rotor": 1.0}]

    def parameters_of(self, summary: JointSummary, constants: Constants) -> tuple[EffectParameter, ...]:
        return self.parameters[: _count(constants)]

    def explained(self, summary: JointSummary) -> str:
        between = f"between {summary.joint_before} and {summary.name}"
        return self.explanation.replace("between the joint and the one before it", between)

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return MOTOR_FORMULAS[: _count(constants)]

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return motor_columns(motion)[:, : _count(constants)]


class SharedMotorDifference(SharedMotorSum):
    """The same for a motor that turns with the difference, as the second of two crossed belts does."""

    name = "shared-motor-difference"
    title = "friction of a motor or belt that turns with the difference of two joints' speeds"
    equation = "F_VD w + F_CD sign(w) + I_aD ẇ,  w = q̇ − (k_before/k) q̇_before,  k: motor turns per turn of the joint"
    explanation = SharedMotorSum.explanation.replace("in the sum of", "in the difference of")
    parameters = (
        EffectParameter("FVD", "N m s/rad", lower=0.0),
        EffectParameter("FCD", "N m", lower=0.0),
        EffectParameter("IaD", "kg m^2", lower=0.0),
    )
    beside = -1.0
    confusable = ("shared-motor-sum", "coupled-friction")


def _count(constants: Constants) -> int:
    """How many columns there are: friction, and the rotor where it has one."""
    return 3 if constants["rotor"] else 2
