"""A recorded joint and the models of it that are exported."""

from __future__ import annotations

import numpy as np
import pytest

from identify import load_experiment
from identify.export.exported_model import exported_model
from identify.export.record_error import Motion
from identify.identification import identify
from tests.identify.export.derivatives import fitted_to, in_formats
from tests.plants.single_joint import record, write_experiment

EVERYTHING = [
    "viscous-asymmetric",
    "viscous-power",
    "stribeck",
    "load-friction",
    "presliding",
    "friction-warmup",
    "joint-spring",
    "friction-position",
    "gain-saturation",
]


@pytest.fixture(scope="session")
def plant(tmp_path_factory):
    recorded = record({"stribeck": 1.0}, seed=5, duration=12.0, payload_masses=(0.0, 4.0))
    return load_experiment(write_experiment(tmp_path_factory.mktemp("plant") / "bench", recorded))


@pytest.fixture(scope="session", params=["usual", "everything", "load-velocity"])
def result(request, plant):
    if request.param == "everything":
        return identify(plant, "usual", EVERYTHING)
    return identify(plant, request.param)


@pytest.fixture(scope="session")
def motion(plant):
    """Held-out motion: random states in a course of positions, so that presliding has a history."""
    random = np.random.default_rng(4)
    q = np.cumsum(random.uniform(-0.02, 0.02, (60, 1)), axis=0)
    dq, ddq = random.uniform(-1, 1, (60, 1)), random.uniform(-3, 3, (60, 1))
    payload = next(own for own in plant.payloads if own.mass > 0)
    return Motion(np.linspace(0, 6, 60), q, dq, ddq, None, payload)


@pytest.fixture(scope="session")
def with_derivatives(plant):
    """Models with derivatives over time, fitted to the sessions without payload."""
    return {
        "delay": fitted_to(plant, "delay"),
        "elasticity": fitted_to(plant, "elasticity"),
        "all": fitted_to(plant, "elasticity", "backlash", "presliding", "gain-saturation", "delay"),
    }


@pytest.fixture(scope="session")
def all_formats(with_derivatives, tmp_path_factory):
    """Of the model with all of them: the folder with the files, and what computes their torques."""
    folder = tmp_path_factory.mktemp("exported")
    return folder, in_formats(exported_model(with_derivatives["all"]), folder)
