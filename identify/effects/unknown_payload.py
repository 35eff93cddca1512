"""A payload whose inertia, centre and mass are asked for instead of declared."""

from identify.dynamics.standard_parameters import LINK_PARAMETERS
from identify.effects.effect import Constants, Effect
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.payload_errors import spread

UNITS = ("kg m^2",) * 6 + ("kg m",) * 3 + ("kg",)


class UnknownPayload(Effect):
    """Columns of the ten link parameters of payloads, each in the sessions that carry it.

    It is not in the catalogue: it is no physical effect that a model could lack, but a question to the record.
    Its constants say which payload has which slot of ten columns (`payload_2: 0.0`).
    """

    name = "unknown-payload"
    group = "payload"
    equation = "τ = D(q, q̇, q̈) [XX XY XZ YY YZ ZZ MX MY MZ M]ᵀ of a body on the last link"
    explanation = "The inertia about the last link's origin, the first moments and the mass of a payload."
    regressors = tuple(f"column of {symbol}" for symbol in LINK_PARAMETERS)
    parameters = tuple(zip(LINK_PARAMETERS, UNITS, strict=True))
    source = "Khalil, Gautier, Lemoine 2007 (the paper's [9])"
    variable = "q"
    rows = "robot"

    def parameters_of(self, summary: JointSummary, constants: Constants) -> tuple[tuple[str, str], ...]:
        named = [summary.payloads[int(key.removeprefix("payload_"))] for key in in_order(constants)]
        return tuple((f"{symbol}[{name}]", unit) for name in named for symbol, unit in self.parameters)

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        return spread(motion.payload_columns, motion, constants)


def in_order(constants: Constants) -> list[str]:
    """The constants' names in the order of their slots."""
    return sorted(constants, key=lambda key: constants[key])
