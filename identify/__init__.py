"""Identification and diagnosis of robot joints: a numerical library, usable from a notebook.

import identify
experiment = identify.load_experiment("experiments/rx130l")
result = identify.identify(experiment, model="usual")
diagnosis = identify.diagnose(experiment, model="usual")
improvement = identify.improve(experiment, model="usual")
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from identify.diagnosis.diagnosis import Diagnosis, diagnose
    from identify.diagnosis.improvement import Improvement, improve
    from identify.effects.catalogue import catalogue
    from identify.identification import Identification, identify
    from identify.recording import Experiment, InputError, load_experiment
    from identify.results.simulation import SimulationDocument
    from identify.simulation.simulate import simulate

__all__ = [
    "Diagnosis",
    "Experiment",
    "Identification",
    "Improvement",
    "InputError",
    "SimulationDocument",
    "catalogue",
    "diagnose",
    "identify",
    "improve",
    "load_experiment",
    "simulate",
]

_HOMES = {
    "Diagnosis": "identify.diagnosis.diagnosis",
    "diagnose": "identify.diagnosis.diagnosis",
    "Improvement": "identify.diagnosis.improvement",
    "improve": "identify.diagnosis.improvement",
    "catalogue": "identify.effects.catalogue",
    "Identification": "identify.identification",
    "identify": "identify.identification",
    "Experiment": "identify.recording",
    "InputError": "identify.recording",
    "load_experiment": "identify.recording",
    "SimulationDocument": "identify.results.simulation",
    "simulate": "identify.simulation.simulate",
}


def __getattr__(name: str) -> object:
    """Import what is asked for and no more: whoever needs only `identify.recording` does not wait for the rest."""
    if name not in _HOMES:
        raise AttributeError(f"module 'identify' has no attribute '{name}'")
    return getattr(importlib.import_module(_HOMES[name]), name)
