"""A pendulum as a model that a plan is judged by, and requests for plans."""

import numpy as np

from daq.excitation.optimal_excitation import Request
from daq.excitation.plan_model import PlanJudgement, PlannedParameter


class Pendulum:
    """τ = J q̈ + MX g cos q + FV q̇ + FC sign q̇, the payload's known torque apart; written for these
    tests.
    """

    name = "pendulum"
    source = "measured on a bench"

    def __init__(self, values=(31.0, 21.0, 48.0, 20.0), is_identified=True, twice=False) -> None:
        names = ["J", "MX", "FV", "FC", *(["FC again"] if twice else [])]
        self.values = np.array([*values, *([0.0] if twice else [])])
        self.is_identified = is_identified
        self.twice = twice
        self.parameters = tuple(
            PlannedParameter(name, "j3", "", None, value)
            for name, value in zip(names, self.values.tolist(), strict=True)
        )

    def rows(self, motion):
        q, dq, ddq = motion.q[:, 0], motion.dq[:, 0], motion.ddq[:, 0]
        columns = [ddq, 9.81 * np.cos(q), dq, np.sign(dq)] + [np.sign(dq)] * self.twice
        return [(np.arange(len(columns)), np.column_stack(columns))]

    def load(self, motion):
        q, ddq = motion.q, motion.ddq
        arm = self.values[0] * ddq + self.values[1] * 9.81 * np.cos(q)
        return arm + motion.payload.mass * 1.277 * (1.277 * ddq + 9.81 * np.cos(q))

    def judge(self, motions):
        return PlanJudgement((), ())

    def torque(self, motion):
        return self.load(motion) + self.values[2] * motion.dq + self.values[3] * np.sign(motion.dq)


def request_of(rig, **changes) -> Request:
    given = {"model": Pendulum(), "payloads": rig.payloads, "seconds": 40.0, "noise": np.array([2.0])}
    return Request(rig=rig, **(given | changes))
