"""Units of mass and length in which the parameters of a machine are of the order of one.

Whatever compares a kilogramme with a kilogramme square metre (a least eigenvalue, the distance of two sets of parameters, a
solver's tolerance) would otherwise hold for machines of about a metre and some kilogrammes alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identify.dynamics.base_parameters import BaseParameters
from identify.dynamics.standard_parameters import standard_units

Array = NDArray[np.float64]

LENGTHS = {"kg": 0, "kg m": 1, "kg m^2": 2}
"""power of the length in each unit of an inertial parameter"""


@dataclass(frozen=True)
class NaturalUnits:
    """A machine's own units.

    mass   : kg
    length : m
    """

    mass: float
    length: float

    @classmethod
    def of_estimate(
        cls, base: BaseParameters, estimate: ArrayLike, information: ArrayLike | None = None
    ) -> NaturalUnits:
        """The units of a machine with (b,) base parameters, each weighed by its part in the torque.

        The length is the longest of the frames' distances, or where joints share their axes' origin that of moments of inertia
        to first moments, or else of these to masses.

        information : (b, b) of the base parameters; a parameter that the record does not tell is not to set the units. Without
            it all count alike
        """
        values = np.abs(np.asarray(estimate, float))
        part = np.ones(len(values))
        if information is not None:
            part = np.sqrt(np.maximum(np.diag(np.asarray(information, float)), 0.0)) * values
        powers = np.array([LENGTHS[unit] for unit in base.units])

        def typical(sizes: Array, of: NDArray[np.bool_]) -> float:
            return float(np.average(sizes[of], weights=part[of])) if np.any(part[of] > 0.0) else 0.0

        second, first, zeroth = (typical(values, powers == power) for power in (2, 1, 0))
        geometry = base.geometry
        length = float(np.abs(np.concatenate([geometry.d, geometry.r])).max())
        if not length and second and first:
            length = second / first
        if not length and first and zeroth:
            length = first / zeroth
        length = length or 1.0
        mass = typical(values / length**powers, np.ones(len(values), bool))
        return cls(mass or 1.0, length)

    def of_base(self, base: BaseParameters) -> Array:
        """(b,) SI value of one natural unit of each base parameter."""
        return self._of(base.units)

    def of_standard(self, base: BaseParameters) -> Array:
        """(11 n,) SI value of one natural unit of each standard parameter."""
        return self._of(standard_units(base.geometry))

    def _of(self, units: tuple[str, ...]) -> Array:
        return np.array([self.mass * self.length ** LENGTHS[unit] for unit in units])
