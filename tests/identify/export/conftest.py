"""A recorded joint and the models of it that are exported."""

from __future__ import annotations

import pytest

from identify import load_experiment
from identify.identification import identify
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


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    recorded = record({"stribeck": 1.0}, seed=5, duration=12.0, payload_masses=(0.0, 4.0))
    return load_experiment(write_experiment(tmp_path_factory.mktemp("plant") / "bench", recorded))


@pytest.fixture(scope="module", params=["usual", "everything", "load-velocity"])
def result(request, plant):
    if request.param == "everything":
        return identify(plant, "usual", EVERYTHING)
    return identify(plant, request.param)
