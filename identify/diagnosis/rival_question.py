"""Two rivals on a joint, and how far motions part them: what the model with the one cannot follow of the other's torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.separation import UNKNOWN, Apart, least_noise, noise_along, unfollowed
from identify.effects.model import Term
from identify.effects.motion import JointSummary
from identify.estimation.fitted_model import FittedModel
from identify.estimation.informed_summary import informed_summaries
from identify.estimation.least_squares import joint_rows
from identify.estimation.observation import FittedTorque, Slot, observe
from identify.estimation.record import Record

Array = NDArray[np.float64]
Index = NDArray[np.intp]

CONTAINED = 1e-6
"""Part of an effect's torque that another leaves of it, below which it is a special case of the other."""


@dataclass(frozen=True)
class _Side:
    """One of two rivals.

    mine   : its columns
    others : all the others, the rival's among them, once for each choice of the rival's constants
    values : its parameters
    noise  : N m, deviation of the residual along what the others cannot follow of its torque
    """

    mine: Index
    others: list[Index]
    values: Array
    noise: float

    def left(self, rows: Array) -> float:
        """Part of its torque that the others cannot follow, whatever constants the rival then has; N m over the rows."""
        torque = rows[:, self.mine] @ self.values
        return min(float(np.linalg.norm(unfollowed(torque, rows[:, others]))) for others in self.others)

    def information(self, rows: Array, further: int, scale: Array) -> float:
        """What the rows say of the parameters that it has beyond a rival which it contains, one over a standard deviation each:
        their geometric mean but for a factor that `scale`, the unit of each column, makes."""
        spread = [
            np.linalg.svd(unfollowed(rows[:, self.mine] / scale, rows[:, others]), compute_uv=False)[:further]
            for others in self.others
        ]
        least = min(spread, key=lambda values: float(np.sum(values**2)))
        return float(np.exp(np.mean(np.log(np.maximum(least, 1e-12)))))


@dataclass(frozen=True)
class Question:
    """Two rivals on a joint, and what the data so far say of them.

    torque : of the fitted model with the first rival: the load of every column
    known  : (rows, width) the joint's rows of the data so far, `joint_rows`
    sides  : of each rival
    """

    record: Record
    joint: int
    slots: list[Slot]
    torque: FittedTorque
    known: Array
    sides: list[_Side]

    @classmethod
    def of(
        cls, record: Record, fits: Sequence[FittedModel], terms: Sequence[Term], joint: int, base: FittedModel
    ) -> Question:
        """From the model with neither (`base`) and with each rival, their constants chosen."""
        summary = informed_summaries(base)[joint]
        choices = [_choices(terms[one], terms[1 - one], summary) for one in (0, 1)]
        slots = [*base.slots]
        for term, listed in zip(terms, choices, strict=True):
            slots += [Slot.of(term.chosen(constants)) for constants in listed]
        torque = fits[0].torque
        known = observe(record, base.entries, slots, torque)
        first = len(base.slots)
        places = [
            known.slot_columns[first : first + len(choices[0])],
            known.slot_columns[first + len(choices[0]) :],
        ]
        beside = np.setdiff1d(np.arange(known.width), np.concatenate([*places[0], *places[1]]))
        least = min(least_noise(fit, joint) for fit in fits)
        sides = []
        for one, other in ((0, 1), (1, 0)):
            mine, values = places[one][0], _values(fits[one], terms[one])
            others = [np.concatenate([beside, theirs]) for theirs in places[other]]
            sides.append(
                _Side(mine, others, values, noise_along(known, joint, mine, others[0], values, least))
            )
        return cls(record, joint, slots, torque, joint_rows(known, joint), sides)

    def apart(self, rows: Array) -> Apart:
        """How far the rivals part on these rows, the data so far among them.

        The smaller of what either cannot follow of the other counts, unless one effect is a special case of the other: then what
        its further parameters come to.
        """
        one, other = self.sides
        left = [side.left(rows) for side in self.sides]
        contained = [
            part <= CONTAINED * float(np.linalg.norm(rows[:, side.mine] @ side.values))
            for part, side in zip(left, self.sides, strict=True)
        ]
        further = len(other.mine) - len(one.mine)
        if contained[0] and further > 0:
            return self._beyond(other, further, rows)
        if contained[1] and further < 0:
            return self._beyond(one, -further, rows)
        apart = [
            part / max(side.noise, 1e-300)
            for part, side, followed in zip(left, self.sides, contained, strict=True)
            if not followed
        ]
        return Apart(min(apart, default=0.0))

    def _beyond(self, wide: _Side, further: int, rows: Array) -> Apart:
        """As much more is known as of what the data so far make of the further parameters; of all, where they make nothing of
        them."""
        left, torque = wide.left(self.known), self.known[:, wide.mine] @ wide.values
        if left > CONTAINED * float(np.linalg.norm(torque)):
            more = wide.left(rows) / left
        else:
            left, norms = 0.0, np.linalg.norm(self.known[:, wide.mine], axis=0)
            scale = np.where(norms > 0, norms, 1.0)
            known, then = (wide.information(each, further, scale) for each in (self.known, rows))
            more = then / known
        return Apart.of_a_wider(left / max(wide.noise, 1e-300), float(np.clip(more, 1.0, UNKNOWN)), further)


def _choices(term: Term, rival: Term, summary: JointSummary) -> list[dict[str, float]]:
    """A term's constants as chosen, those that the rival has of the same names, and those around: a fit to other data would
    choose anew."""
    chosen, of_rival = dict(term.constants or ()), dict(rival.constants or ())
    shared = {name: of_rival.get(name, value) for name, value in chosen.items()}
    listed = [chosen]
    for constants in (shared, *term.effect.refine(chosen, summary)):
        if constants not in listed:
            listed.append(dict(constants))
    return listed


def _values(fit: FittedModel, term: Term) -> Array:
    for slot, columns in zip(fit.slots, fit.observation.slot_columns, strict=True):
        if slot.term.key == term.key:
            return fit.fit.chi[columns]
    return np.zeros(0)
