"""Many small least-squares problems at once: every choice of a candidate's columns, on every training set.

A diagnosis asks some ten thousand of them, of one to three unknowns mostly. They are solved together, grouped by their
number of columns; only those whose estimate breaks a relation between parameters are looked at one by one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product as combinations_of
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from identify.effects.admissible import Admissible
from identify.estimation.constrained import nearest_admissible

Array = NDArray[np.float64]
Index = NDArray[np.intp]

DEPENDENT = 1e-6
"""A candidate column of whose power less than this is left beside the base adds nothing that could be seen."""
WIDEST_FACED = 3
"""Unknowns whose ranges' faces are all looked at (27 at three) rather than searched for by iteration."""
INNER_RIDGE = 1e-9
"""of unit columns; two columns of one effect may be one to the last digit"""


class OptionFits(NamedTuple):
    """Of every set and option, (sets, options) each.

    gain  : how much the option lowers the squared error of its training set
    error : squared error on the judged rows with its estimates
    power : squared norm of the option's share there
    """

    gain: Array
    error: Array
    power: Array


@dataclass(frozen=True)
class Remainder:
    """Products of what is left of columns and Y beside a base, on several sets of rows; of some pairs, when asked.

    A candidate needs the products among its own columns only, which are few, and not those with all other candidates'.

    products : (sets, …) of pairs of columns before anything is taken out, from two arrays of their places; Y is place −1
    one, other : (sets, m, c + 1) what is taken out of the product of i and j is the sum over m of one[i] · other[j]
    """

    products: Callable[[Index, Index], Array]
    one: Array
    other: Array

    def size(self, places: Index) -> Array:
        """(sets, options, k) power of columns before the base is taken out."""
        return self.products(places, places)

    def within(self, places: Index) -> Array:
        """(sets, options, k, k) among the columns of each option; places: (options, k)."""
        products = self.products(places[:, :, None], places[:, None, :])
        one, other = (each[:, :, places].transpose(0, 2, 3, 1) for each in (self.one, self.other))
        return products - one @ other.swapaxes(2, 3)

    def with_target(self, places: Index) -> Array:
        """(sets, options, k) of the columns of each option with Y."""
        products = self.products(places, np.array(-1))
        return products - np.einsum("smvk,sm->svk", self.one[:, :, places], self.other[:, :, -1])

    def target(self) -> Array:
        """(sets,) of Y with itself."""
        taken = np.einsum("sm,sm->s", self.one[:, :, -1], self.other[:, :, -1])
        return self.products(np.array(-1), np.array(-1)) - taken


def fit_options(
    trained: Remainder, judged: Remainder, options: Sequence[Index], bounds: Sequence[Admissible | None]
) -> OptionFits:
    """Fit each option's columns on each training set, inside what its parameters can be, and judge it elsewhere.

    trained : on the training sets
    judged  : the same combinations on the rows to be judged
    options : of each the places of its columns
    bounds  : of each what its parameters can be; None, or of another number of parameters: anything
    """
    alone = judged.target()
    gain = np.zeros((len(alone), len(options)))
    error = np.repeat(alone[:, None], len(options), axis=1)
    power = np.zeros_like(gain)
    counts = np.array([len(option) for option in options])
    for width in sorted(set(counts.tolist()) - {0}):
        chosen = [index for index, count in enumerate(counts.tolist()) if count == width]
        places = np.array([options[index] for index in chosen])
        problem = _Problem.of(trained, places)
        values = problem.solved([bounds[index] for index in chosen])
        gain[:, chosen] = problem.gain(values)
        values = values / problem.scale
        power[:, chosen] = np.einsum("fvi,fvij,fvj->fv", values, judged.within(places), values)
        error[:, chosen] += power[:, chosen] - 2 * np.einsum(
            "fvi,fvi->fv", values, judged.with_target(places)
        )
    return OptionFits(gain, error, power)


class _Problem(NamedTuple):
    """Options of one number of columns k: unit columns, those that are not seen beside the base set to nothing.

    inner   : (sets, options, k, k)
    product : (sets, options, k)
    scale   : (sets, options, k) norms of the columns
    seen    : (sets, options, k)
    """

    inner: Array
    product: Array
    scale: Array
    seen: NDArray[np.bool_]

    @classmethod
    def of(cls, trained: Remainder, places: Index) -> "_Problem":
        inner = trained.within(places)
        diagonal = np.arange(places.shape[1])
        power = inner[:, :, diagonal, diagonal]
        seen = power > DEPENDENT * np.maximum(trained.size(places), 1e-300)
        scale = np.sqrt(np.where(seen, power, 1.0))
        inner = inner / (scale[..., :, None] * scale[..., None, :])
        inner *= seen[..., :, None] & seen[..., None, :]
        inner[:, :, diagonal, diagonal] = 1.0 + INNER_RIDGE * seen
        product = np.where(seen, trained.with_target(places) / scale, 0.0)
        return cls(inner, product, scale, seen)

    def gain(self, values: Array) -> Array:
        """(sets, options) how much values of the unit columns lower the squared error."""
        return np.asarray(
            2 * np.einsum("fvi,fvi->fv", self.product, values)
            - np.einsum("fvi,fvij,fvj->fv", values, self.inner, values)
        )

    def solved(self, bounds: Sequence[Admissible | None]) -> Array:
        """(sets, options, k) values of the unit columns with the least squared error inside what they can be."""
        width = self.product.shape[2]
        if width == 1:
            values = self.product / self.inner[..., 0]
        else:
            values = np.asarray(np.linalg.solve(self.inner, self.product[..., None])[..., 0], float)
        known = [None if each is None or len(each.lower) != width else each for each in bounds]
        lower = np.array([np.full(width, -np.inf) if each is None else each.lower for each in known])
        upper = np.array([np.full(width, np.inf) if each is None else each.upper for each in known])
        low, high = (
            np.where(self.seen, bound * self.scale, free)
            for bound, free in ((lower, -np.inf), (upper, np.inf))
        )
        outside = np.any((values < low) | (values > high), axis=2)
        related = np.array([each is not None and len(each.least) > 0 for each in known])
        for option in np.flatnonzero(related):
            relations = known[option]
            assert relations is not None  # it has some
            reached = (values[:, option] / self.scale[:, option]) @ relations.matrix.T
            outside[:, option] |= np.any(reached < relations.least, axis=1)
        plain = outside & ~related
        if width == 1:
            values[plain] = np.clip(values, low, high)[plain]
        elif width <= WIDEST_FACED and plain.any():
            values[plain] = _on_a_face(self.inner[plain], self.product[plain], low[plain], high[plain])
        else:
            related[:] = True
        for place, option in zip(*np.nonzero(outside & related), strict=True):
            admissible = known[option]
            assert admissible is not None  # it is outside of something
            seen = self.seen[place, option]
            bound = admissible.of(seen, self.scale[place, option, seen])
            inner = self.inner[place, option][np.ix_(seen, seen)]
            factor = np.asarray(np.linalg.cholesky(inner).T, float)
            values[place, option, seen] = nearest_admissible(factor, values[place, option, seen], bound)
        return values


def _on_a_face(inner: Array, product: Array, lower: Array, upper: Array) -> Array:
    """(problems, k) the least squared error of unknowns with a range each, of problems whose least is outside.

    On every face of the ranges (some unknowns at one end, the others free) the least is one small solution; where the free
    ones are inside, it can be had, and the best of these is the least of all, for the error is convex.
    """
    count = inner.shape[1]
    best = np.full(len(inner), -np.inf)
    solutions = np.zeros((len(inner), count))
    for ends in combinations_of((None, lower, upper), repeat=count):
        at, free = np.zeros_like(solutions), []
        for place, end in enumerate(ends):
            if end is None:
                free.append(place)
            else:
                at[:, place] = end[:, place]
        possible = np.flatnonzero(np.isfinite(at).all(axis=1))
        if len(free) == count or not len(possible):
            continue
        values, of_these = at[possible], inner[possible]
        if free:
            target = product[possible] - np.einsum("vij,vj->vi", of_these, values)
            solved = np.linalg.solve(of_these[:, free][:, :, free], target[:, free, None])[..., 0]
            values[:, free] = solved
            low, high = lower[possible][:, free], upper[possible][:, free]
            inside = ((solved >= low) & (solved <= high)).all(axis=1)
            possible, values, of_these = possible[inside], values[inside], of_these[inside]
        gain = 2 * np.einsum("vi,vi->v", product[possible], values)
        gain -= np.einsum("vi,vij,vj->v", values, of_these, values)
        better = gain > best[possible]
        best[possible[better]], solutions[possible[better]] = gain[better], values[better]
    return solutions
