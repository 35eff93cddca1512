"""What a planning job computes, in a process of its own."""

from pathlib import Path

from api.service.job_process import Progress
from daq.excitation.standard_plan import standard_plan
from daq.rig import Rig


def plan(progress: Progress, rig: str, name: str, seconds: float, model: str, seed: int) -> str:
    """A plan within the limits of the rig in file `rig`; returns the plan file's text."""
    progress(0.0, "planning")
    made = standard_plan(Rig.load(Path(rig)), seconds, seed, name)
    return made.model_copy(update={"model": model}).to_json()
