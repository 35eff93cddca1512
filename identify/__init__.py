"""Identification and diagnosis of robot joints: a numerical library, usable from a notebook.

import identify
experiment = identify.load_experiment("experiments/rx130l")
result = identify.identify(experiment, model="usual")
"""

from identify.effects.catalogue import catalogue
from identify.estimation.identification import Identification, identify
from identify.recording import Experiment, InputError, load_experiment

__all__ = ["Experiment", "Identification", "InputError", "catalogue", "identify", "load_experiment"]
