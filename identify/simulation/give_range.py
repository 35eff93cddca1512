"""What a give between a motor and its link can be, by physics and by what a record can show."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.effects.give import LEAST_SHARE, Give
from identify.effects.transmission import LARGEST_DEFLECTION

Array = NDArray[np.float64]

STIFFEST = 1e-4
"""of the largest compliance: beyond, a spring is as good as none"""

FINEST = 1e-4
"""of a joint's range of motion, the smallest gap; and no gap is finer than two steps of the encoder"""

FLANKS = (1e-3, 0.5)
"""of the largest load, under which the flanks of a gap are closed"""


MOST_ON_LINK = 1.5
"""of the dry friction that the fit without a link's friction has, which its columns of what gives may have made too small"""


LEAST_ON_LINK = 0.05
"""of the dry friction: less on the link makes a search end a little lower, and no motion another"""

PARTS_ON_LINK = (0.25, 0.5, 0.75, 1.0)
"""of the dry friction, to begin a search with"""


@dataclass(frozen=True)
class GiveRange:
    """The range of a give, and how a search goes through it; SI units.

    Its values are the link's share of the inertia; of a spring the logarithm of its compliance and its damping ratio, the
    motor held; of a gap the logarithms of its width and of the load that closes its flanks; last, where the joint has dry
    friction, how much of it is on the link.

    inertia    : smallest of the joint, rotor included
    load       : largest that it carries
    span       : range of its positions
    resolution : step of its encoder
    dry        : N m or N, dry friction of the joint of which a part may be on the link; 0 for none there
    """

    inertia: float
    load: float
    span: float
    resolution: float
    spring: bool
    gap: bool
    dry: float = 0.0

    @cached_property
    def lower(self) -> Array:
        """(values,)"""
        least = [LEAST_SHARE]
        if self.spring:
            least += [np.log(STIFFEST * self._largest / self.load), 0.0]
        if self.gap:
            finest = max(2.0 * self.resolution, FINEST * self.span)
            least += [np.log(min(finest, 0.5 * self._largest)), np.log(FLANKS[0] * self.load)]
        if self.dry:
            least += [0.0]
        return np.array(least)

    @cached_property
    def upper(self) -> Array:
        """(values,)"""
        most = [1.0 - LEAST_SHARE]
        if self.spring:
            most += [np.log(self._largest / self.load), 1.0]
        if self.gap:
            most += [np.log(self._largest), np.log(FLANKS[1] * self.load)]
        if self.dry:
            most += [MOST_ON_LINK]
        return np.array(most)

    @property
    def _largest(self) -> float:
        """rad or m that motor and link can be apart."""
        return LARGEST_DEFLECTION * self.span

    def give(self, values: Array) -> Give:
        """The give of some values (values,)."""
        share, rest = float(values[0]), [float(value) for value in values[1:]]
        rotor = (1.0 - share) * self.inertia
        on_link = rest.pop() * self.dry if self.dry else 0.0
        give = Give(rotor, link_dry=on_link)
        if self.spring:
            compliance, ratio = float(np.exp(rest[0])), rest[1]
            relaxation = 2.0 * ratio * float(np.sqrt(compliance * (self.inertia - rotor)))
            give = replace(give, compliance=compliance, relaxation=0.0 if self.gap else relaxation)
        if self.gap:
            give = replace(give, gap=float(np.exp(rest[-2])), flank_load=float(np.exp(rest[-1])))
        return give

    def values(self, give: Give) -> Array:
        """(values,) of a give, as near as the range has them."""
        listed = [1.0 - give.rotor / self.inertia]
        if self.spring:
            compliance = max(give.compliance, 1e-300)
            slowest = 2.0 * np.sqrt(compliance * max(self.inertia - give.rotor, 1e-300))
            listed += [np.log(compliance), give.relaxation / slowest]
        if self.gap:
            listed += [np.log(give.gap), np.log(give.flank_load)]
        if self.dry:
            listed += [give.link_dry / self.dry]
        return np.clip(listed, self.lower, self.upper)

    def starts(self) -> list[Array]:
        """Values to begin a search from: both shares of the inertia, and the upper decades of what gives."""
        listed = [[share] for share in (0.35, 0.65)]
        if self.spring:
            soft = self.upper[1] - np.log([30.0, 10.0, 4.0, 1.5])
            listed = [[*values, each, 0.1] for values in listed for each in soft]
        if self.gap:
            width = 3 if self.spring else 1
            wide = np.linspace(self.lower[width], self.upper[width], 7)[1:-1]
            flank = np.log(0.02 * self.load)
            listed = [[*values, each, flank] for values in listed for each in wide]
        if self.dry:
            listed = [[*values, part] for values in listed for part in PARTS_ON_LINK[::2]]
        return [np.array(values) for values in listed]
