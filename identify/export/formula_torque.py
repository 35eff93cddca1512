"""The torque of an exported model by its own formulas, as the Python module computes them."""

from __future__ import annotations

from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.payload import payload_parameters
from identify.export.exported_model import ExportedModel
from identify.export.python_code import python_code
from identify.export.record_error import Motion, TorqueOf

Array = NDArray[np.float64]


def module_of(model: ExportedModel) -> ModuleType:
    """The exported Python module, made in memory."""
    module = ModuleType("exported")
    exec(compile(python_code(model), "exported", "exec"), module.__dict__)
    return module


def module_torque(module: ModuleType, model: ExportedModel) -> TorqueOf:
    """What an exported Python module predicts, its memories carried from row to row."""

    def torque_of(asked: Motion) -> Array:
        motion = asked.continued(model.latency)
        memory = None
        if model.memories:
            states = [module.memory_at_start(motion.dq[0])]
            for row in range(1, len(motion.q)):
                states.append(module.memory_after(states[-1], motion.q[row - 1], motion.q[row]))
            memory = [np.array([state[index] for state in states]) for index in range(len(model.memories))]
        temperature = None if motion.temperature is None else motion.temperature.T
        if model.latency:
            torque = module.torque_along(
                motion.q.T,
                motion.dq.T,
                motion.ddq.T,
                motion.t,
                motion.t,
                temperature,
                memory,
                payload_parameters(motion.payload),
            )
            return torque.T[: len(asked.q)]
        return module.torque(
            motion.q.T,
            motion.dq.T,
            motion.ddq.T,
            motion.t,
            temperature,
            memory,
            payload_parameters(motion.payload),
        ).T

    return torque_of
