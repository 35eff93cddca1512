"""A functional mock-up unit, loaded and stepped by FMPy (extra `fmu`)."""

from __future__ import annotations

import ctypes
import importlib.util
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.payload import payload_parameters
from identify.export.exported_model import ExportedModel
from identify.export.fmi_source import ValueReferences
from identify.export.fmu import WARM
from identify.export.record_error import Motion, TorqueOf

Array = NDArray[np.float64]


def has_fmpy() -> bool:
    """Whether FMPy is installed."""
    return importlib.util.find_spec("fmpy") is not None


def fmu_torque(path: Path, model: ExportedModel) -> TorqueOf:
    """What a unit returns, row by row: an instance for each motion, a step from each row to the next.

    It is unpacked beside its file.
    """
    from fmpy import extract, read_model_description
    from fmpy.fmi3 import FMU3Slave, fmi3Float64, fmi3ValueReference

    description = read_model_description(path)
    co_simulation = description.coSimulation
    assert co_simulation is not None  # the unit is ours
    unpacked = extract(path, path.with_suffix(".unpacked"))
    references = ValueReferences(model)
    n = model.joints

    def array(kind, values):
        return (kind * len(values))(*values)

    def torque_of(motion: Motion) -> Array:
        unit = FMU3Slave(
            guid=description.guid,
            unzipDirectory=unpacked,
            modelIdentifier=co_simulation.modelIdentifier,
            instanceName="exported",
        )
        inputs = array(fmi3ValueReference, references.inputs)
        outputs = array(fmi3ValueReference, references.torque)
        warm = np.full(motion.q.shape, float(WARM)) if motion.temperature is None else motion.temperature
        rows = np.ascontiguousarray(np.hstack([motion.q, motion.dq, motion.ddq, warm]), float)
        out = np.zeros(motion.q.shape)
        unit.instantiate()
        try:
            payload = [float(value) for value in payload_parameters(motion.payload)]
            unit.setFloat64(list(references.payload), payload)
            for row, values in enumerate(rows):
                if row == 0:
                    unit.enterInitializationMode(startTime=float(motion.t[0]))
                given = values.ctypes.data_as(ctypes.POINTER(fmi3Float64))
                unit.fmi3SetFloat64(unit.component, inputs, len(inputs), given, len(inputs))
                if row == 0:
                    unit.exitInitializationMode()
                else:
                    before = float(motion.t[row - 1])
                    unit.doStep(before, float(motion.t[row]) - before)
                torque = out[row].ctypes.data_as(ctypes.POINTER(fmi3Float64))
                unit.fmi3GetFloat64(unit.component, outputs, n, torque, n)
            unit.terminate()
        finally:
            unit.freeInstance()
        return out

    return torque_of
