"""The paper's model in its linear form, eq. (30): base parameters and dry friction split by the power sign."""

import numpy as np

from identify.effects.dry_friction import (
    Coulomb,
    LoadFrictionAsymmetric,
    LoadStribeck,
    Offset,
    quadrant_directions,
    quadrants,
)
from identify.effects.effect import Constants, DeclaredLoad, Effect, geometric_grid
from identify.effects.motion import Array, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter, Relation
from identify.effects.viscous import Stribeck, Viscous, finer_stribeck, stribeck_range, stribeck_step

SPLIT = tuple(EffectParameter(symbol, "1", lower=0.0) for symbol in ("a_m", "b_m", "a_g", "b_g"))
"""of the load: what the gear passes on when driving and when driven, and stiction's share less sliding's"""
DRY = tuple(EffectParameter(symbol, "N m", lower=0.0) for symbol in ("c_m", "d_m", "c_g", "d_g"))
"""levels of dry friction for each power sign, and what stiction has above them"""

SMOOTH = (Viscous.name, Offset.name)
"""effects of eq. (30) beside its dry friction"""
SPLIT_BY_POWER_SIGN = (Coulomb.name, LoadFrictionAsymmetric.name, Stribeck.name, LoadStribeck.name)
"""effects of the usual kind that the equation says for each power sign anew"""


class LoadVelocity(Effect):
    """Columns of eq. (30) and (42) for one joint; they replace the base parameters' own columns.

    It is not in the catalogue: what it adds to the usual model are the catalogue's `load-friction-asymmetric`,
    `stribeck` and `load-stribeck`. Its products a_m·J, b_m·MX … have one value for each quadrant pair.
    """

    catalogued = False
    name = "load-velocity"
    group = "load"
    equation = "P⁺(a_m + b_m E)τ_out + P⁻(a_g − b_g E)τ_out + P⁺(c_m + d_m E)sign(q̇) + P⁻(c_g + d_g E)sign(q̇)"
    explanation = "Dry friction that depends on load and velocity, one set of parameters for each power sign."
    regressors = (
        "P⁺ D",
        "P⁺ E D",
        "P⁻ D",
        "−P⁻ E D",
        "P⁺ sign(q̇)",
        "P⁺ E sign(q̇)",
        "P⁻ sign(q̇)",
        "P⁻ E sign(q̇)",
    )
    parameters = DRY  # those of the products depend on the joint's base parameters (`linear_names`)
    source = "paper, eq. (30), (42), (43)"
    uses_load = True
    rows = "gear"
    declared_load = DeclaredLoad.TRUSTED

    def replaces_payload_ratio(self, constants: Constants) -> bool:
        return True

    def grid(self, summary: JointSummary) -> list[dict[str, float]]:
        return geometric_grid("stribeck_velocity", *stribeck_range(summary), 9)

    def refine(self, constants: Constants, summary: JointSummary) -> list[dict[str, float]]:
        return finer_stribeck(constants, summary, stribeck_step(summary, 9))

    def loads(self, motion: JointMotion) -> Array:
        """(samples, k) the parts of the load that have parameters of their own."""
        # one known load beside the base parameters: its a_m and a_g are the paper's M_ae/M_aw split by quadrant
        return np.column_stack([motion.inertial, motion.known_load])

    def columns(self, motion: JointMotion, constants: Constants) -> Array:
        driving, driven = quadrants(motion.load, motion.direction)
        fading = np.exp(-np.abs(motion.dq) / constants["stribeck_velocity"])
        loads = self.loads(motion)
        split = [loads * factor[:, None] for factor in (driving, driving * fading, driven, -driven * fading)]
        ahead, back = quadrant_directions(motion.load, motion.direction)
        return np.hstack([*split, np.column_stack([ahead, fading * ahead, back, fading * back])])


class GearFriction(LoadVelocity):
    """Columns of eq. (30) with the load of a fitted model as one: what is left to find is the gear's, q̇_s with it.

    Eight columns instead of four for each base parameter; their best q̇_s is that of the whole equation.
    """

    name = "gear-friction"
    regressors = (
        "P⁺ τ_out",
        "P⁺ E τ_out",
        "P⁻ τ_out",
        "−P⁻ E τ_out",
        "P⁺ sign(q̇)",
        "P⁺ E sign(q̇)",
        "P⁻ sign(q̇)",
        "P⁻ E sign(q̇)",
    )
    parameters = (*SPLIT, *DRY)

    def relations(self, summary: JointSummary, constants: Constants) -> tuple[Relation, ...]:
        # whatever the scale of the load: a_m − a_g = α_m + α_g of eq. (20)
        loss = {(self.name, 0): 1.0, (self.name, 2): -1.0}
        return (
            Relation(
                loss, 0.0, "a gear asks for no less when it drives the load than when the load drives it"
            ),
        )

    def loads(self, motion: JointMotion) -> Array:
        return motion.load[:, None]


def linear_names(base_names: list[str], base_units: list[str]) -> list[tuple[str, str]]:
    """Names and units of the columns, in their order: a_m·J …, a_m, b_m·J …, c_m, d_m, c_g, d_g."""
    named = [
        (f"{split.name}·{name}", unit)
        for split in SPLIT
        for name, unit in [*zip(base_names, base_units, strict=True), ("1", "1")]
    ]
    return [(name.removesuffix("·1"), unit) for name, unit in named] + [(dry.name, dry.unit) for dry in DRY]
