"""Standard parameters of bodies with mass that have the identified base parameters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.natural_units import NaturalUnits
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT
from identify.estimation.feasible import nearest_feasible, pseudo_inertia
from identify.estimation.least_squares import joint_rows
from identify.export.exported_model import ExportedModel
from identify.identification import Identification

Array = NDArray[np.float64]

BASE_KEPT = 1e-9
"""part of the largest base parameter in the machine's own units by which bodies may differ from the estimate and have kept it"""

NOT_SEEN = 1e-9
"""weight of the relative distance beside the metric of the fit, for parameters that the record does not tell"""


def feasible_standard(
    result: Identification, model: ExportedModel, rotors: bool = True
) -> tuple[Array, bool]:
    """(11 n,) standard parameters of bodies with mass, and whether they have the identified base parameters.

    rotors : whether a joint may have a rotor with an inertia of its own

    Raises InputError: the extra `feasible` is not installed.
    """
    base, fit, observation = model.base, result.fitted.fit, result.fitted.observation
    seen = None
    if result.structured is None:
        rows = np.vstack(
            [joint_rows(observation, joint) * weight for joint, weight in enumerate(fit.weights)]
        )
        rigid_rows = rows[:, : observation.base]
        seen = rigid_rows.T @ rigid_rows
    natural = NaturalUnits.of_estimate(base, model.chi, seen)
    unit = natural.of_base(base)
    largest = float(np.abs(model.chi / unit).max())
    relative = np.diag(1.0 / (unit * np.maximum(np.abs(model.chi / unit), 1e-3 * largest)) ** 2)
    if seen is None:
        information = relative
    else:
        metric = np.outer(unit, unit)
        share = float(np.trace(seen * metric)) / float(np.trace(relative * metric))
        information = seen + NOT_SEEN * share * relative
    standard = nearest_feasible(base, model.chi, information, rotors).standard
    place = np.arange(len(standard)) % PARAMETERS_PER_JOINT == PARAMETERS_PER_JOINT - 1
    standard = np.where(place, np.maximum(standard, 0.0) if rotors else 0.0, standard)
    # the solver is good to some millionths; what is left of the estimate is put into parameters of the bodies
    standard_unit = natural.of_standard(base)
    free = np.where(place, 0.0, base.matrix * standard_unit / unit[:, None])
    left = (model.chi - base.matrix @ standard) / unit
    exact = standard + standard_unit * (np.linalg.pinv(free) @ left)
    links = exact.reshape(-1, PARAMETERS_PER_JOINT)
    bodies = all(float(np.linalg.eigvalsh(pseudo_inertia(link)).min()) > 0 for link in links)
    off = float(np.abs((base.from_standard(exact) - model.chi) / unit).max())
    return (exact, True) if bodies and off <= BASE_KEPT * largest else (standard, False)
