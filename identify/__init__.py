"""Identification and diagnosis of robot joints: a numerical library, usable from a notebook.

import identify
experiment = identify.load_experiment("experiments/rx130l")
result = identify.identify(experiment, model="usual")
diagnosis = identify.diagnose(experiment, model="usual")
story = identify.improve(experiment, model="usual")
"""

from identify.diagnosis.diagnosis import Diagnosis, diagnose
from identify.diagnosis.improvement import Improvement, improve
from identify.effects.catalogue import catalogue
from identify.estimation.identification import Identification, identify
from identify.recording import Experiment, InputError, load_experiment

__all__ = [
    "Diagnosis",
    "Experiment",
    "Identification",
    "Improvement",
    "InputError",
    "catalogue",
    "diagnose",
    "identify",
    "improve",
    "load_experiment",
]
