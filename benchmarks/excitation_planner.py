"""How long planning takes and what it gains over a plan made for no model, for one joint and for six.

Run: python -m benchmarks.excitation_planner
"""

import time

import numpy as np

from api.assumed_masses import torque_limits
from api.plan_model import RegressorModel
from daq.excitation.optimal_excitation import Request, information_of, optimal_plan
from daq.excitation.standard_plan import standard_plan
from daq.rig import Rig

CASES = (
    ("rx130l-joint3-simulated", "usual", 60.0, 10.0),
    ("rx130l-joint3-simulated", "load-velocity", 60.0, 10.0),
    ("tx40-simulated", "rigid+viscous,coulomb,offset,coupled-friction", 90.0, 60.0),
    ("tx40-simulated", "load-velocity", 90.0, 60.0),
)


def main() -> None:
    """Print the table; the peer is the standard plan of the same length."""
    print(f"{'rig':<26}{'model':<18}{'CPU s':>8}{'aim s':>8}{'condition':>11}{'peer':>9}{'std / peer':>12}")
    for name, model, seconds, aim in CASES:
        rig = Rig.load(name)
        request = Request(
            rig=rig,
            model=RegressorModel(rig, model, rig.payloads),
            payloads=rig.payloads,
            seconds=seconds,
            noise=np.asarray(0.01 * torque_limits(rig)),
        )
        begin = time.process_time()
        plan = optimal_plan(request)
        spent = time.process_time() - begin
        best, peer = information_of(plan, request), information_of(standard_plan(rig, seconds), request)
        ratios = [
            own / other
            for own, other in zip(best.deviations(), peer.deviations(), strict=True)
            if own and other
        ]
        print(
            f"{name:<26}{model[:17]:<18}{spent:8.1f}{aim:8.0f}{best.condition_number or np.nan:11.1f}"
            f"{peer.condition_number or np.nan:9.1f}{np.exp(np.mean(np.log(ratios))):12.2f}"
        )


if __name__ == "__main__":
    main()
