"""Physically consistent inertial parameters nearest to an estimate (extra `feasible`).

Base parameters that fit best need not belong to any body: an inertia may come out negative. A link is a body with
mass if its pseudo-inertia

    P = [ Σ  h ]      Σ = ½ tr(I) 1 − I,  h = (MX MY MZ),  m = M
        [ hᵀ m ]

is positive definite (P. M. Wensing, S. Kim, J.-J. E. Slotine, "Linear matrix inequalities for physically consistent
inertial parameter identification", IEEE Robot. Autom. Lett. 3(1), 2018). Of all standard parameters with P ≻ 0 for
every link and Ia >= 0 for every rotor, those are taken whose base parameters lie nearest to the estimate in the metric
of the fit: (G chi_st − chi)ᵀ S (G chi_st − chi), S the information of the base parameters with all other columns
estimated beside them. That is a semidefinite programme.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.base_parameters import BaseParameters
from identify.dynamics.natural_units import NaturalUnits
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT, standard_names, standard_units
from identify.estimation.identified import Identified
from identify.estimation.least_squares import joint_rows
from identify.recording import InputError
from identify.results.identification import (
    FeasibleBaseParameter,
    FeasibleParameters,
    FeasibleStandardParameter,
)

Array = NDArray[np.float64]

LEAST_EIGENVALUE = 1e-6
"""smallest eigenvalue of a pseudo-inertia in the machine's own units; a body has some extent, and the solver some tolerance"""
PREFERENCE = 1e-6
"""weight of the least total trace among standard parameters with the same base parameters, in parts of the metric"""


@dataclass(frozen=True)
class Feasible:
    """Standard parameters of real bodies.

    standard : (11 n,) one choice of many that have these base parameters
    base     : (b,) base parameters
    distance : how far they lie from the estimate in the metric of the fit
    """

    standard: Array
    base: Array
    distance: float


def pseudo_inertia(link: Array) -> Array:
    """(4, 4) of a link's XX XY XZ YY YZ ZZ MX MY MZ M."""
    xx, xy, xz, yy, yz, zz, mx, my, mz, mass = link[:10]
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    first = np.array([mx, my, mz])
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return np.block([[second, first[:, None]], [first[None, :], np.array([[mass]])]])


def nearest_feasible(
    base: BaseParameters, estimate: Array, information: Array, rotors: bool = True
) -> Feasible:
    """The feasible parameters nearest to `estimate` (b,) in the metric `information` (b, b), positive semidefinite.

    rotors : whether a joint may have a rotor with an inertia of its own; formats without one need bodies alone
    Raises InputError: the extra `feasible` is not installed, or the solver found nothing.
    """
    try:
        import cvxpy
    except ImportError:
        raise InputError("--feasible: needs the extra 'feasible': pip install 'coulomb[feasible]'") from None
    natural = NaturalUnits.of_estimate(base, estimate, information)
    unit, standard_unit = natural.of_base(base), natural.of_standard(base)
    values, vectors = np.linalg.eigh(information * np.outer(unit, unit))
    root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T
    aim, mapping = estimate / unit, base.matrix * standard_unit / unit[:, None]
    size = float(np.linalg.norm(root @ aim)) or 1.0
    standard = cvxpy.Variable(base.matrix.shape[1])
    directions = [_pseudo_inertia_of_one(index) for index in range(10)]
    constraints, traces = [], []
    for link in range(base.matrix.shape[1] // PARAMETERS_PER_JOINT):
        start = link * PARAMETERS_PER_JOINT
        rotor = start + PARAMETERS_PER_JOINT - 1
        pseudo = sum(standard[start + index] * direction for index, direction in enumerate(directions))
        constraints += [
            cvxpy.PSD(pseudo - LEAST_EIGENVALUE * np.eye(4)),
            standard[rotor] >= 0 if rotors else standard[rotor] == 0,
        ]
        traces.append(cvxpy.trace(pseudo))
    misfit = cvxpy.norm((root / size) @ (mapping @ standard - aim))
    problem = cvxpy.Problem(cvxpy.Minimize(misfit + PREFERENCE * sum(traces)), constraints)
    try:
        problem.solve(solver=cvxpy.CLARABEL)
    except cvxpy.SolverError:
        raise InputError(
            "no physically consistent parameters were found: the solver made no headway; a model with fewer effects, or more"
            " motion, may determine the bodies better"
        ) from None
    if standard.value is None:
        raise InputError(f"no physically consistent parameters were found ({problem.status})")
    parameters = np.asarray(standard.value, float) * standard_unit
    projected = base.from_standard(parameters)
    return Feasible(parameters, projected, float(np.linalg.norm(root @ ((projected - estimate) / unit))))


def _pseudo_inertia_of_one(index: int) -> Array:
    """(4, 4) where one parameter of a link is 1 and the others are 0."""
    link = np.zeros(10)
    link[index] = 1.0
    return pseudo_inertia(link)


def feasible_parameters(result: Identified) -> FeasibleParameters:
    """The feasible parameters beside an identification's, as part of its document.

    Raises InputError: the model has no base parameters of its own, or see `nearest_feasible`.
    """
    fitted, record = result.fitted, result.fitted.record
    fit, observation, base = fitted.fit, fitted.observation, record.body.base
    inertial = fit.fitted[fit.fitted < observation.base]
    if not len(inertial):
        raise InputError(
            "--feasible: the linear load-velocity form has no base parameters of its own; use rigid, usual or effects"
        )
    others = fit.fitted[fit.fitted >= observation.base]
    rows = np.vstack([joint_rows(observation, joint) * weight for joint, weight in enumerate(fit.weights)])
    W, V = rows[:, inertial], rows[:, others]
    left = W - V @ np.linalg.lstsq(V, W, rcond=None)[0] if len(others) else W
    information = np.zeros((observation.base, observation.base))
    information[np.ix_(inertial, inertial)] = left.T @ left
    nearest = nearest_feasible(base, fit.chi[: observation.base], information)
    residual = rows[:, -2] - rows[:, : observation.base] @ nearest.base
    if len(others):
        residual = residual - V @ np.linalg.lstsq(V, residual, rcond=None)[0]
    measured = float(np.linalg.norm(rows[:, -1]))
    before = rows[:, -2] - rows[:, :-2] @ fit.chi
    geometry = base.geometry
    listed = zip(standard_names(geometry), standard_units(geometry), nearest.standard, strict=True)
    return FeasibleParameters(
        weighted_error_of_estimate=float(np.linalg.norm(before)) / measured,
        weighted_error_of_feasible=float(np.linalg.norm(residual)) / measured,
        base=tuple(
            FeasibleBaseParameter(name=name, estimate=float(old), value=float(new), unit=unit)
            for name, unit, old, new in zip(base.names, base.units, fit.chi, nearest.base, strict=False)
        ),
        standard=tuple(
            FeasibleStandardParameter(name=name, value=float(value), unit=unit)
            for name, unit, value in listed
        ),
        remark="the standard parameters are one choice of many with these base parameters",
    )
