"""Loads that are not what was declared: payload mass, payload centre, direction of gravity."""

from dataclasses import replace

import numpy as np

from identify.effects.conditions import KNOWN_PAYLOAD, WIDE_RANGE, Condition
from identify.effects.effect import Constants, DeclaredLoad, Effect
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter
from identify.effects.picture import OVER_LOAD, OVER_POSITION

STANDARD_GRAVITY = 9.80665
"""m/s², ISO 80000-3"""


class PayloadMass(Effect):
    name = "payload-mass"
    title = "a payload mass that differs from the one stated"
    group = "payload"
    equation = "(M_ae/M_aw)_p τ_payload,  one ratio for each payload p"
    explanation = (
        "A payload is heavier or lighter than declared. Check: weigh it again, with its flange and screws."
    )
    regressors = ("τ_payload of payload p",)
    parameters = (EffectParameter("mass_ratio", "1", lower=-1.0),)  # as fitted: the ratio less 1
    source = "paper, eq. (35)"
    conditions = (KNOWN_PAYLOAD,)
    variable = "known load"
    picture = OVER_LOAD
    confusable = ("drive-gain", "payload-com")
    uses_load = True
    known_beforehand = True
    declared_load = DeclaredLoad.QUESTIONED
    estimates_ratio = True
    rows = "robot"

    def parameters_of(self, summary: JointSummary, constants: Constants) -> tuple[EffectParameter, ...]:
        ratio = self.parameters[0]
        return tuple(
            replace(ratio, name=f"{ratio.name}[{summary.payloads[p]}]") for p in loaded_payloads(summary)
        )

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        return [payload_slots(summary)]

    def reported_offset(self, constants: Constants) -> float:
        return 1.0

    def replaces_payload_ratio(self, constants: Constants) -> bool:
        return True

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return spread(motion.known_load[:, None], motion, constants)


class PayloadCentre(Effect):
    name = "payload-com"
    title = "a payload centre that differs from the one stated"
    group = "payload"
    equation = "∂τ_payload/∂c · δc_p,  the displacement of the centre of mass of each payload p"
    explanation = (
        "The centre of mass of a payload is not where it was declared. Check: how the payload is mounted; measure the "
        "distance from the flange to its centre."
    )
    regressors = ("∂τ_payload/∂c_x", "∂τ_payload/∂c_y", "∂τ_payload/∂c_z")
    parameters = (EffectParameter("com_x", "m"), EffectParameter("com_y", "m"), EffectParameter("com_z", "m"))
    source = "paper, eq. (32)-(34)"
    conditions = (KNOWN_PAYLOAD,)
    variable = "q"
    picture = OVER_POSITION
    confusable = ("payload-mass", "gravity-tilt")
    uses_load = True
    declared_load = DeclaredLoad.QUESTIONED
    rows = "robot"

    def parameters_of(self, summary: JointSummary, constants: Constants) -> tuple[EffectParameter, ...]:
        return tuple(
            replace(axis, name=f"{axis.name}[{summary.payloads[p]}]")
            for p in loaded_payloads(summary)
            for axis in self.parameters
        )

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        return [payload_slots(summary)]

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return spread(motion.payload_gradient, motion, constants)


class GravityTilt(Effect):
    name = "gravity-tilt"
    title = "a base that is not level"
    group = "payload"
    equation = "∂τ_out/∂g · δg"
    explanation = (
        "Gravity does not point where the model says: the base is tilted. "
        "Check: a spirit level on the base; the gravity vector in the rig file."
    )
    regressors = ("∂τ_out/∂g_1", "∂τ_out/∂g_2")
    # at most all of gravity, on a base that lies on its side
    parameters = (
        EffectParameter("tilt_1", "m/s²", lower=-STANDARD_GRAVITY, upper=STANDARD_GRAVITY),
        EffectParameter("tilt_2", "m/s²", lower=-STANDARD_GRAVITY, upper=STANDARD_GRAVITY),
    )
    source = "gravity term Q(q) of eq. (2), first order in the tilt"
    conditions = (WIDE_RANGE, Condition("for a single joint: a payload change"))
    variable = "q"
    picture = OVER_POSITION
    confusable = ("payload-com", "joint-spring")
    uses_load = True
    declared_load = DeclaredLoad.QUESTIONED
    rows = "robot"

    def formulas(self, constants: Constants) -> tuple[str, ...] | None:
        return ("gravity_1", "gravity_2")

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return motion.gravity_gradient


def loaded_payloads(summary: JointSummary) -> list[int]:
    """Indices of the payloads that have a mass and were carried in some session."""
    carried = set(summary.payload_of_session)
    return [p for p, mass in enumerate(summary.payload_masses) if mass > 0 and p in carried]


def payload_slots(summary: JointSummary) -> dict[str, float]:
    """Which group of columns belongs to which payload, as constants of the effect."""
    return {f"payload_{p}": float(slot) for slot, p in enumerate(loaded_payloads(summary))}


def spread(columns: Array, motion: JointMotion, constants: Constants) -> Array:
    """Put a payload's columns into its own slot; the others' slots are zero in this session."""
    width = columns.shape[1]
    out = np.zeros((len(columns), width * len(constants)))
    slot = constants.get(f"payload_{motion.payload}")
    if slot is not None:
        start = round(slot) * width
        out[:, start : start + width] = columns
    return out
