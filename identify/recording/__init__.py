"""The experiment on disk."""

from identify.recording.errors import InputError
from identify.recording.experiment import Experiment, load_experiment
from identify.recording.experiment_file import (
    DeclaredSession,
    ExperimentFile,
    Joint,
    JointLimits,
    Payload,
    Robot,
    SignalCutoffs,
    append_effect,
    append_session,
    change_session,
    write_experiment,
)
from identify.recording.session import Session, SessionEntry

__all__ = [
    "DeclaredSession",
    "Experiment",
    "ExperimentFile",
    "InputError",
    "Joint",
    "JointLimits",
    "Payload",
    "Robot",
    "Session",
    "SessionEntry",
    "SignalCutoffs",
    "append_effect",
    "append_session",
    "change_session",
    "load_experiment",
    "write_experiment",
]
