"""Dry friction of a link behind its transmission: what it takes over one step of an implicit rule, stick and slip solved with it.

The friction opposes the speed that the link ends the step with, and is whatever leaves that speed at zero where neither way is
one that the link can go (Karnopp 1985; Moreau 1988 for the implicit form). A link that turns round within the step has the one
sign until then and the other from then on, in the mean of the step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.effects.give import Give

Array = NDArray[np.float64]

FLANK = 0.01
"""of what a link gives way: by which the flanks of a gap do between a motor and a link that are both held"""


def link_friction(
    limit: float,
    going: Array,
    solved: Callable[[Array], tuple[Array, Array]],
    holding: Callable[[], Array],
) -> tuple[Array, Array]:
    """What gears carry and what friction takes of it over a step, N m or N; (windows,) each.

    limit   : dry friction of the links, N m or N
    going   : speed of the links as the step begins
    solved  : what is carried, and the speed that the link ends with, under a friction; that speed falls with the friction
    holding : friction that would leave the link at rest
    """
    way = np.where(going < 0.0, -1.0, 1.0)
    friction = way * limit
    carried, speed = solved(friction)
    settled = speed * way > 0.0
    if settled.all():
        return carried, friction
    turning = going / np.where(settled | (going == speed), 1.0, going - speed)
    friction = np.where(settled, friction, friction * (2.0 * turning - 1.0))
    carried, speed = solved(friction)
    settled |= speed * way < 0.0
    if settled.all():
        return carried, friction
    friction = np.where(settled, friction, np.clip(holding(), -limit, limit))
    return solved(friction)[0], friction


@dataclass(slots=True)
class Transmission:
    """One transmission within a sweep, (windows,): what it carries, by its twist at the end of a rule's step.

    twist   : that there would be if nothing drove the link, and its motor carried `before`
    behind  : rad/(N m) or m/N by which the motor gives way to what is carried
    ahead   : by which the link does
    """

    give: Give
    twist: Array
    behind: Array
    ahead: Array
    before: Array

    def carried(self, friction: Array | float) -> Array:
        """What is carried where dry friction takes some of it."""
        free = self.twist + self.behind * self.before + self.ahead * friction
        return self.give.load_where(free, self.behind + self.ahead)

    def with_friction(self, going: Array, speed: Array, late: Array) -> tuple[Array, Array]:
        """What is carried and what the link's dry friction takes of it.

        going : the link's speed as the step begins
        speed : at its end if nothing drove it; more by `late` for each N m or N that does
        """

        def solved(friction: Array) -> tuple[Array, Array]:
            carried = self.carried(friction)
            return carried, speed + late * (carried - friction)

        def holding() -> Array:
            driving = -speed / late
            flank = 0.0 if self.give.compliance else FLANK
            yielding = np.maximum(self.behind, flank * self.ahead)
            free = self.twist - self.ahead * driving + yielding * self.before
            return self.give.load_where(free, yielding) - driving

        return link_friction(self.give.link_dry, going, solved, holding)
