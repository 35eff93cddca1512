"""What a joint did in the sessions of a fit, as its transmission feels it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.inverse_dynamics import InverseDynamics
from identify.dynamics.payload import payload_parameters
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT
from identify.effects.give import JointCourse
from identify.estimation.fitted_model import FittedModel

Array = NDArray[np.float64]

STEP = 1e-6
"""rad or m, of the difference quotient over a joint's position"""

SHORTEST = 8
"""samples without a hole, of which differences over time are made"""


def joint_courses(fitted: FittedModel, chi: Array, joint: int) -> list[JointCourse]:
    """The stretches without a hole of the sessions of the fit, at the rate of the decimated samples.

    chi : (b,) base parameters of the load
    """
    record, courses = fitted.record, []
    base = record.body.base
    for entry in fitted.entries:
        payload = np.zeros(PARAMETERS_PER_JOINT * record.joints)
        payload[-PARAMETERS_PER_JOINT:-1] = payload_parameters(entry.payload)
        rigid = InverseDynamics(base.geometry, [base.nearest_standard(chi) + payload])
        samples = record.samples[entry.file]
        gaps = np.diff(samples.time)
        period = float(np.median(gaps))
        for rows in np.split(np.arange(len(samples.time)), np.flatnonzero(gaps > 1.5 * period) + 1):
            if len(rows) < SHORTEST:
                continue
            q, dq, ddq = samples.q[rows], samples.dq[rows], samples.ddq[rows]
            moved, faster = q.copy(), ddq.copy()
            moved[:, joint] += STEP
            faster[:, joint] += 1.0
            load, further, more = (
                rigid.torques(*motion)[0][:, joint]
                for motion in ((q, dq, ddq), (moved, dq, ddq), (q, dq, faster))
            )
            courses.append(
                JointCourse(
                    period,
                    float(np.ptp(q[:, joint])),
                    dq[:, joint],
                    ddq[:, joint],
                    load,
                    (further - load) / STEP,
                    more - load,
                )
            )
    return courses
