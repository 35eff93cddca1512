"""A payload whose inertia, centre and mass are asked for instead of declared."""

from dataclasses import replace
from math import inf

from identify.dynamics.standard_parameters import LINK_PARAMETERS
from identify.effects.effect import Constants, Effect
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter, Relation
from identify.effects.payload_errors import spread

UNITS = ("kg m^2",) * 6 + ("kg m",) * 3 + ("kg",)


class UnknownPayload(Effect):
    """Columns of the ten link parameters of payloads, each in the sessions that carry it.

    It is not in the catalogue: it is no physical effect that a model could lack, but a question to the record.
    Its constants say which payload has which slot of ten columns (`payload_2: 0.0`).
    """

    catalogued = False
    name = "unknown-payload"
    group = "payload"
    equation = "τ = D(q, q̇, q̈) [XX XY XZ YY YZ ZZ MX MY MZ M]ᵀ of a body on the last link"
    explanation = "The inertia about the last link's origin, the first moments and the mass of a payload."
    regressors = tuple(f"column of {symbol}" for symbol in LINK_PARAMETERS)
    parameters = tuple(
        EffectParameter(symbol, unit, lower=0.0 if symbol in ("XX", "YY", "ZZ", "M") else -inf)
        for symbol, unit in zip(LINK_PARAMETERS, UNITS, strict=True)
    )
    source = "Khalil, Gautier, Lemoine 2007 (the paper's [9])"
    variable = "q"
    rows = "robot"

    def parameters_of(self, summary: JointSummary, constants: Constants) -> tuple[EffectParameter, ...]:
        named = [summary.payloads[int(key.removeprefix("payload_"))] for key in in_order(constants)]
        return tuple(replace(each, name=f"{each.name}[{name}]") for name in named for each in self.parameters)

    def relations(self, summary: JointSummary, constants: Constants) -> tuple[Relation, ...]:
        moments = [LINK_PARAMETERS.index(symbol) for symbol in ("XX", "YY", "ZZ")]
        return tuple(
            Relation(
                {
                    (self.name, len(LINK_PARAMETERS) * slot + m): -1.0 if m == largest else 1.0
                    for m in moments
                },
                0.0,
                "no moment of inertia of a body is more than the sum of the other two",
            )
            for slot in range(len(constants))
            for largest in moments
        )

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return spread(motion.payload_columns, motion, constants)


def in_order(constants: Constants) -> list[str]:
    """The constants' names in the order of their slots."""
    return sorted(constants, key=lambda key: constants[key])
