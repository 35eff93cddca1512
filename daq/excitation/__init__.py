"""What the joints are to do so that a model can be identified: sinusoids and trapezoids within the rig's
limits.
"""

from daq.excitation.excitation_plan import ExcitationPlan, Setpoints
from daq.excitation.plan_limits import Violation, require_within_limits, violations
from daq.excitation.sinusoid import Sinusoids
from daq.excitation.standard_plan import approach, standard_plan
from daq.excitation.trapezoid import Dwell, Move

__all__ = [
    "Dwell",
    "ExcitationPlan",
    "Move",
    "Setpoints",
    "Sinusoids",
    "Violation",
    "approach",
    "require_within_limits",
    "standard_plan",
    "violations",
]
