"""Effects between the recorded command and the torque: gain, saturation, timing."""

import numpy as np

from identify.effects.conditions import KNOWN_LOAD_OR_SESSIONS, Condition
from identify.effects.effect import Constants, DeclaredLoad, Effect, number
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter
from identify.effects.picture import AROUND_REVERSALS, OVER_LOAD


class GainSaturation(Effect):
    name = "gain-saturation"
    title = "a drive gain that falls at large current"
    group = "actuation"
    equation = "c sign(τ) max(0, |τ| − τ_0)^p,  τ: the model's own torque"
    explanation = (
        "The motor gives less torque per ampere at high current: the iron saturates, or the amplifier limits. "
        "Check: motor data sheet (torque constant over current); keep peak currents lower."
    )
    regressors = ("sign(τ) max(0, |τ| − τ_0)^p",)
    parameters = (
        EffectParameter("saturation", "N m/(N m)^p", lower=0.0),
    )  # more current than torque, never less
    source = "torque-constant saturation of permanent-magnet motors, e.g. Hanselman 2006, ch. 4"
    conditions = (Condition("torques up to the maximum"),)
    variable = "torque"
    picture = OVER_LOAD
    confusable = ("drive-gain",)
    uses_load = True
    uses_torque = True

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        largest = max(abs(summary.load_range[0]), abs(summary.load_range[1]))
        return [{"threshold": 0.0, "power": 3.0}] + [
            {"threshold": part * largest, "power": 2.0} for part in (0.0, 0.25, 0.5, 0.7)
        ]

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        excess = f"max(0.0, abs(torque) - {number(constants['threshold'])})"
        return (f"sign(torque) * {excess} ** {number(constants['power'])}",)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        torque = motion.model_torque
        excess = np.maximum(0.0, np.abs(torque) - constants["threshold"])
        return (np.sign(torque) * excess ** constants["power"])[:, None]


class DriveGain(Effect):
    name = "drive-gain"
    title = "a wrong drive gain"
    group = "actuation"
    equation = "(M_ae/M_aw) τ_known, one ratio for all known loads; or c_s τ in session s"
    explanation = (
        "Every known load appears too heavy or too light by the same factor, or all torques of a session do: the drive "
        "gain g_f (gear ratio, amplifier gain, torque constant) is not what the settings say, or it changed between "
        "sessions. Check: torque constant and amplifier gain in the rig file; what was exchanged between sessions."
    )
    regressors = ("τ_known", "or τ in each later session")
    parameters = (EffectParameter("gain_ratio", "1", lower=-1.0),)  # as fitted: the ratio less 1
    source = "paper, eq. (4) and (35)"
    conditions = (KNOWN_LOAD_OR_SESSIONS,)
    variable = "known load"
    picture = OVER_LOAD
    confusable = ("payload-mass",)
    uses_load = True
    declared_load = DeclaredLoad.QUESTIONED
    estimates_ratio = True
    uses_torque = True

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        choices: list[dict[str, float]] = []
        if summary.loaded_sessions or summary.has_external_force:
            choices.append({})
        if len(summary.sessions) > 1:
            choices.append(
                {f"session_{session}": float(slot) for slot, session in enumerate(summary.sessions[1:])}
            )
        return choices

    def parameters_of(self, summary: JointSummary, constants: Constants) -> tuple[EffectParameter, ...]:
        if not constants:
            return self.parameters
        return tuple(
            EffectParameter(f"gain_change[{name.removeprefix('session_')}]", "1", lower=-1.0)
            for name in constants
        )

    def reported_offset(self, constants: Constants) -> float:
        return 0.0 if constants else 1.0

    def replaces_payload_ratio(self, constants: Constants) -> bool:
        return not constants  # one ratio for all known loads is what the payload ratios would say again

    def of_sessions(self, constants: Constants) -> bool:
        return bool(constants)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        if not constants:
            return motion.known_load[:, None]
        out = np.zeros((len(motion.q), len(constants)))
        slot = constants.get(f"session_{motion.session}")
        if slot is not None:
            out[:, round(slot)] = motion.model_torque
        return out


class Delay(Effect):
    name = "delay"
    title = "a delay between position and current"
    group = "timing"
    equation = "−δ dτ/dt,  τ: the model's own torque"
    explanation = (
        "The recorded command and the recorded position do not belong to the same instant (filters, fieldbus cycles, "
        "wrong time stamps). Check: where each signal is sampled; the time stamps of the recording; it is not the mechanism."
    )
    regressors = ("−dτ/dt",)
    # positive where the command is recorded late, negative where it acts late or the position is recorded late
    parameters = (EffectParameter("delay", "s"),)
    source = "Gautier, Poignet 2001; measured on EMPS"
    conditions = (Condition("fast changes of torque"),)
    variable = "ddq"
    picture = AROUND_REVERSALS
    confusable = ("elasticity",)
    from_derivatives = True
    uses_load = True
    uses_torque = True
    simulated = "command"
    formula_derivatives = (1,)

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return ("-torque",)

    def command_lead(self, values: Array) -> float:
        return float(values[0])

    def made_by_recording(self, values: Array, margins: Array, sampling_period: float) -> str | None:
        """A controller holds its command over a period, while the position is that of one instant.

        Recorded at the period's start the command is early by half of one, at its end late by as much: by just that, so
        that how far the estimate may be from its value decides.
        """
        beyond = abs(abs(float(values[0])) - 0.5 * sampling_period)
        if beyond > float(margins[0]):
            return None
        return (
            "It is half a period of sampling, as a command makes that is held over its period: recorded at the start it "
            "is early by so much, at the end late. By itself it is no fault of the machine."
        )

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return -np.gradient(motion.model_torque, motion.period)[:, None]
