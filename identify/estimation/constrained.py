"""Least squares inside what the parameters can be, on the triangular factor of a fit.

minimise ‖R (χ − χ_ls)‖ with lower ≤ χ ≤ upper and matrix · χ ≥ least: a least-distance problem in z = R (χ − χ_ls), which
one non-negative least squares solves (C. L. Lawson, R. J. Hanson, "Solving Least Squares Problems", 1974, chapter 23).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.effects.admissible import Admissible, admissible_values
from identify.effects.motion import JointSummary
from identify.estimation.least_squares import LeastSquares, residual_norms
from identify.estimation.observation import Observation

Array = NDArray[np.float64]

OUTSIDE = 1e-6
"""Of a parameter's scale (what moves the residual by its own norm): nearer to a bound than this is inside."""


def nearest_admissible(r: Array, chi: Array, admissible: Admissible) -> Array:
    """(k,) the admissible values that raise ‖R χ − y‖ the least, `chi` being where it is smallest.

    r : (k, k) triangular factor of the columns, regular
    """
    count = len(chi)
    eye = np.eye(count)
    low, high = np.isfinite(admissible.lower), np.isfinite(admissible.upper)
    G = np.vstack([eye[low], -eye[high], admissible.matrix])
    h = np.concatenate([admissible.lower[low], -admissible.upper[high], admissible.least])
    scale = 1.0 / np.maximum(np.linalg.norm(r, axis=0), 1e-300)
    size = np.abs(G) @ np.maximum(scale, np.abs(chi))
    G, h, size = G[size > 0], h[size > 0], size[size > 0]
    G, h = G / size[:, None], h / size
    short = h - G @ chi
    if not len(h) or short.max() <= OUTSIDE:
        return chi
    from scipy.optimize import nnls

    onto = np.linalg.solve(r.T, G.T)  # columns: constraints as seen by z
    unit = max(float(np.abs(short).max()), 1e-300)
    table = np.vstack([onto, short[None, :] / unit])
    target = np.append(np.zeros(count), 1.0)
    try:
        weights, _ = nnls(table, target)
    except RuntimeError:  # no convergence within its iterations: the values stay what least squares says
        return chi
    rest = table @ weights - target
    if abs(rest[-1]) < 1e-12:
        return chi  # the bounds contradict each other
    z = -rest[:-1] / rest[-1] * unit
    nearest = np.clip(chi + np.linalg.solve(r, z), admissible.lower, admissible.upper)
    # a parameter that a bound holds is at the bound, not a rounding beside it
    least, most = np.flatnonzero(low), np.flatnonzero(high)
    least, most = least[weights[: len(least)] > 0], most[weights[len(least) :][: len(most)] > 0]
    nearest[least], nearest[most] = admissible.lower[least], admissible.upper[most]
    return nearest


def admissible_fit(observation: Observation, fit: LeastSquares, admissible: Admissible) -> LeastSquares:
    """A fit with its parameters inside what they can be; the same fit where they are already.

    admissible : of all columns, (width,)
    """
    columns = fit.fitted
    if not len(columns):
        return fit
    # a column that the data do not show has no value that a relation could hold against others
    unseen = np.delete(np.arange(len(fit.chi)), columns)
    known = ~np.any(admissible.matrix[:, unseen] != 0, axis=1)
    inner = Admissible(
        admissible.lower[columns],
        admissible.upper[columns],
        admissible.matrix[known][:, columns],
        admissible.least[known],
    )
    values = nearest_admissible(fit.r, fit.chi[columns], inner)
    if values is fit.chi[columns] or np.array_equal(values, fit.chi[columns]):
        return fit
    chi = fit.chi.copy()
    chi[columns] = values
    return replace(fit, chi=chi, residual=residual_norms(observation, chi), free=fit.chi)


def admissible_columns(observation: Observation, summaries: Sequence[JointSummary]) -> Admissible:
    """What the parameters of an observation's columns can be; the base parameters, combinations of masses and inertias,
    are free (`feasible` says what they can be together)."""
    listed = [
        (slot.term, slot.values, len(columns))
        for slot, columns in zip(observation.slots, observation.slot_columns, strict=True)
    ]
    values = admissible_values(listed, summaries)
    free = np.full(observation.base, np.inf)
    return Admissible(
        np.concatenate([-free, values.lower]),
        np.concatenate([free, values.upper]),
        np.hstack([np.zeros((len(values.matrix), observation.base)), values.matrix]),
        values.least,
    )
