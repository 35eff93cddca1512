"""Functions of one variable without any physics, as rivals to the catalogue.

Where a free function of, say, position explains at one stroke what several effects of the catalogue together only
approach, the cause depends on that variable in a way that the catalogue does not know; then the effects imitate it.
"""

from dataclasses import dataclass

import numpy as np

from identify.diagnosis.deciding_constants import DROP_PER_PARAMETER
from identify.diagnosis.finding import gained
from identify.effects.effect import Constants, Effect
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter

SPEED_KNOTS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.35, 0.55, 0.8, 1.0)
"""parts of the top speed, either direction; denser where friction curves bend"""
LOAD_KNOTS = 9


def hats(values: Array, knots: Array) -> Array:
    """Piecewise linear hat functions, (samples, knots)."""
    place = np.clip(np.searchsorted(knots, values) - 1, 0, len(knots) - 2)
    share = np.clip((values - knots[place]) / (knots[place + 1] - knots[place]), 0.0, 1.0)
    out = np.zeros((len(values), len(knots)))
    rows = np.arange(len(values))
    out[rows, place] = 1 - share
    out[rows, place + 1] += share
    return out


class _FreeFunction(Effect):
    group = "free"
    explanation = "A free function of one variable; it names no cause."
    parameters = (EffectParameter("free", "N m"),)
    source = "piecewise linear functions"


class FreePosition(_FreeFunction):
    name = "q"
    equation = "Σ a_k B_k(q) + sign(q̇) Σ b_k B_k(q)"
    regressors = ("B_k(q)", "B_k(q) sign(q̇)")
    variable = "q"

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        knots = np.unique(summary.position_quantiles)
        return [{f"knot_{index:02d}": float(knot) for index, knot in enumerate(knots)}]

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        shapes = hats(motion.q, np.array([constants[name] for name in sorted(constants)]))
        return np.hstack([shapes, shapes * motion.direction[:, None]])


class FreeSpeed(_FreeFunction):
    name = "dq"
    equation = "Σ a_k B_k(q̇) + a_0 sign(q̇)"
    regressors = ("B_k(q̇)", "sign(q̇)")
    variable = "dq"

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        return [{"top": max(summary.maximum_speed, 1e-9)}]

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        knots = constants["top"] * np.array([*(-np.array(SPEED_KNOTS[:0:-1])), *SPEED_KNOTS])
        return np.column_stack([hats(motion.dq, knots), motion.direction])


class FreeLoad(_FreeFunction):
    name = "load"
    equation = "Σ a_k B_k(τ_out) + sign(q̇) Σ b_k B_k(τ_out)"
    regressors = ("B_k(τ_out)", "B_k(τ_out) sign(q̇)")
    variable = "load"
    uses_load = True

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        low, high = summary.load_range
        return [{"from": low, "to": max(high, low + 1e-9)}]

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        shapes = hats(motion.load, np.linspace(constants["from"], constants["to"], LOAD_KNOTS))
        return np.hstack([shapes, shapes * motion.direction[:, None]])


FREE_FUNCTIONS: tuple[Effect, ...] = (FreePosition(), FreeSpeed(), FreeLoad())


@dataclass(frozen=True)
class FreeFunction:
    """How a free function of one variable fares beside a model.

    error, without : relative held-out error with it, and without
    parameters     : number of its columns
    """

    variable: str
    error: float
    without: float
    parameters: int

    def lead_over(self, parameters: int) -> float:
        """Square of the relative error by which it must do better than effects with fewer parameters, as any wider candidate."""
        return gained(DROP_PER_PARAMETER * max(self.parameters - parameters, 0)) * self.without**2
