"""A parameter of an effect: its name, its unit, what it can be, and how it bounds others."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect: what multiplies one of its columns.

    name  : without the joint's number, which is appended
    unit  : for a revolute joint; N m reads as N, rad as m for a prismatic one
    lower, upper : what it can be, as fitted; unbounded if not said
    """

    name: str
    unit: str
    lower: float = -inf
    upper: float = inf


@dataclass(frozen=True)
class Relation:
    """Σ coefficient · parameter ≥ least, over parameters of effects of one joint.

    coefficients : by effect and index of its parameter; an effect that the model lacks counts as 0
    reason       : why, for a reader
    """

    coefficients: Mapping[tuple[str, int], float]
    least: float
    reason: str
