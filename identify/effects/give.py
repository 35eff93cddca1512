"""The give between a motor and its link: how far the motor stands ahead of the link under what it carries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_SHARE = 0.1
"""of a joint's inertia that stands on either side of the give at least: identification tells the inertia of both together"""


@dataclass(frozen=True)
class Give:
    """twist(load) = compliance · load + gap/2 · load / flank_load, |load| ≤ flank_load: a spring and a gap in series; SI units.

    rotor      : kg m² or kg, inertia on the motor's side
    compliance : rad/(N m) or m/N
    gap        : rad or m, from flank to flank
    flank_load : N m or N, at which half the gap is taken up
    relaxation : s, damping over stiffness of a spring: twist + relaxation · its rate is what the load makes it at rest
    link_dry   : N m or N, dry friction on the link; all other friction is on the motor
    """

    rotor: float
    compliance: float = 0.0
    gap: float = 0.0
    flank_load: float = 1.0
    relaxation: float = 0.0
    link_dry: float = 0.0

    def twist(self, load: Array) -> Array:
        """How far the motor stands ahead of the link at rest, rad or m."""
        return self.compliance * load + 0.5 * self.gap * np.clip(load / self.flank_load, -1.0, 1.0)

    def load_where(self, free: Array, yielding: Array) -> Array:
        """The load with twist(load) + yielding · load = free.

        free     : twist that there would be if nothing was carried
        yielding : rad/(N m) or m/N by which motor and link come together under the load; above zero where there is a gap
        """
        linear = self.compliance + yielding
        if not self.gap:
            return free / linear
        between = free / (linear + 0.5 * self.gap / self.flank_load)
        beyond = np.copysign(np.abs(free) - 0.5 * self.gap, free) / linear
        return np.where(np.abs(between) <= self.flank_load, between, beyond)

    def energy(self, load: Array) -> Array:
        """J, stored in the spring and in flanks that give."""
        flanks = np.minimum(load**2 / self.flank_load, self.flank_load)
        return 0.5 * self.compliance * load**2 + 0.25 * self.gap * flanks

    def in_words(self, revolute: bool) -> str:
        """Its values with units, the motor's inertia last."""
        length, torque, inertia = ("rad", "N m", "kg m²") if revolute else ("m", "N", "kg")
        parts = []
        if self.compliance:
            parts.append(f"a stiffness of {1.0 / self.compliance:.3g} {torque}/{length}")
        if self.gap:
            parts.append(f"a gap of {self.gap:.3g} {length}")
        description = f"{' and '.join(parts)} before a rotor of {self.rotor:.3g} {inertia}"
        return (
            f"{description}, {self.link_dry:.3g} {torque} of the dry friction on the link"
            if self.link_dry
            else description
        )
