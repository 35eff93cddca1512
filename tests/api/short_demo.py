"""A plan with which a demo takes as little time as it can."""

from api.simulated_demo import RIG
from daq.excitation.standard_plan import standard_plan
from daq.excitation.trapezoid import Dwell
from daq.rig import Rig


def short_plan(rest: float = 0.5) -> str:
    """The first moves of a standard plan as a plan's file has them, 7 s; before them the joint rests for `rest` s."""
    whole = standard_plan(Rig.load(RIG), 18.1)
    return whole.model_copy(update={"phases": (Dwell(duration=rest), *whole.phases[1:8])}).to_json()
