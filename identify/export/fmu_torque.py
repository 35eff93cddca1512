"""A functional mock-up unit, loaded and stepped by FMPy (extra `fmu`)."""

from __future__ import annotations

import ctypes
import importlib.util
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.payload import payload_parameters
from identify.export.fmu import PAYLOAD, WARM
from identify.export.record_error import Motion, TorqueOf
from identify.recording import InputError

Array = NDArray[np.float64]


def has_fmpy() -> bool:
    """Whether FMPy is installed."""
    return importlib.util.find_spec("fmpy") is not None


def fmu_torque(path: Path) -> TorqueOf:
    """What a unit returns, row by row: an instance for each motion, a step from each row to the next.

    It is unpacked beside its file; variables are found by the names in its description.
    Raises InputError: FMPy does not take the unit.
    """
    from fmpy import extract, read_model_description
    from fmpy.fmi3 import FMU3Slave, fmi3Float64, fmi3ValueReference

    try:
        description = read_model_description(path)
        unpacked = extract(path, path.with_suffix(".unpacked"))
    except Exception as refusal:  # FMPy raises bare ones
        raise InputError(f"{path.name}: FMPy does not take it: {_first_line(refusal)}") from None
    co_simulation = description.coSimulation
    waits = re.search(
        r"for the motion (\d+) steps before",
        next((str(each.description) for each in description.modelVariables if each.name == "torque1"), ""),
    )
    latency = int(waits[1]) if waits else 0
    by_name = {variable.name: variable.valueReference for variable in description.modelVariables}
    n = sum(re.fullmatch(r"torque\d+", name) is not None for name in by_name)
    numbered = range(1, n + 1)
    try:
        asked = [by_name[f"{name}{j}"] for name in ("q", "dq", "ddq", "temperature") for j in numbered]
        shown = [by_name[f"torque{j}"] for j in numbered]
        carried = [by_name[f"payload_{name}"] for name in PAYLOAD]
    except KeyError as missing:
        raise InputError(f"{path.name}: the unit has no variable {missing}") from None
    if co_simulation is None:
        raise InputError(f"{path.name}: the unit is not for co-simulation")

    def array(kind, values):
        return (kind * len(values))(*values)

    def torque_of(motion: Motion) -> Array:
        try:
            return stepped(motion.continued(latency))[latency:]
        except Exception as refusal:  # FMPy raises bare ones
            raise InputError(f"{path.name}: FMPy could not run it: {_first_line(refusal)}") from None

    def stepped(motion: Motion) -> Array:
        unit = FMU3Slave(
            guid=description.guid,
            unzipDirectory=unpacked,
            modelIdentifier=co_simulation.modelIdentifier,
            instanceName="exported",
        )
        inputs = array(fmi3ValueReference, asked)
        outputs = array(fmi3ValueReference, shown)
        warm = np.full(motion.q.shape, float(WARM)) if motion.temperature is None else motion.temperature
        rows = np.ascontiguousarray(np.hstack([motion.q, motion.dq, motion.ddq, warm]), float)
        out = np.zeros(motion.q.shape)
        unit.instantiate()
        try:
            payload = [float(value) for value in payload_parameters(motion.payload)]
            unit.setFloat64(carried, payload)
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


def _first_line(refusal: Exception) -> str:
    return (str(refusal).strip().splitlines() or [type(refusal).__name__])[0]
