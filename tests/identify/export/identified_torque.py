"""The torque of the identified model itself, which exports are compared with."""

from __future__ import annotations

import numpy as np

from identify.export.record_error import Motion
from identify.simulation.torque_model import TorqueModel, Windows


def of_the_model(result, motion):
    """The identifier's own columns on that motion."""
    fitted = result.fitted if result.structured is None else result.structured.fitted
    entry = next(own for own in result.experiment.sessions if own.payload.name == motion.payload.name)
    model = TorqueModel(fitted, entry)
    start = fitted.record.facts(entry).start
    found = []
    memory = None
    for row in range(len(motion.q)):
        one = Windows(
            motion.t[row : row + 1] + start,
            motion.q[row : row + 1],
            motion.dq[row : row + 1],
            np.sign(motion.dq[row : row + 1]),
        )
        if memory is None:
            memory = model.started(one)
        else:
            memory = model.advanced(memory, motion.q[row - 1 : row], motion.q[row : row + 1])
        found.append(
            model.torque(
                Windows(one.time, one.q, one.dq, one.direction, memory=memory), motion.ddq[row : row + 1]
            )[0]
        )
    return np.array(found)


def without_payload_ratio(result, motion):
    """The ratio M_ae/M_aw corrects the declared payload, which an exported arm does not carry: judged without one."""
    bare = next(own for own in result.experiment.payloads if own.mass == 0)
    return Motion(motion.t, motion.q, motion.dq, motion.ddq, None, bare)
