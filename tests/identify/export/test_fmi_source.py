"""What the unit of a model with derivatives over time keeps, and goes back to."""

from __future__ import annotations

import numpy as np
import pytest

from identify.export.exported_model import exported_model
from identify.export.fmi_source import ValueReferences
from tests.identify.export.derivatives import PERIOD, sine


def test_a_unit_is_set_back_to_a_state_and_to_its_beginning(with_derivatives, all_formats):
    fmpy = pytest.importorskip("fmpy", reason="FMPy (extra fmu) is not installed")
    slave_of = pytest.importorskip("fmpy.fmi3").FMU3Slave
    folder, _ = all_formats
    if not (folder / "arm.fmu").is_file():
        pytest.skip("no C compiler on this machine")
    validate = pytest.importorskip("fmpy.validation").validate_fmu
    assert validate(str(folder / "arm.fmu")) == []
    description = fmpy.read_model_description(folder / "arm.fmu")
    references = ValueReferences(exported_model(with_derivatives["all"]))
    motion = sine(with_derivatives["all"].experiment.payloads[0], np.arange(12) * PERIOD)
    slave = slave_of(
        guid=description.guid,
        unzipDirectory=fmpy.extract(folder / "arm.fmu", folder / "unit"),
        modelIdentifier="arm",
        instanceName="tried",
    )
    shown = [*references.torque, *references.states]

    def driven(rows):
        given = []
        for row in rows:
            inputs = [float(part[row, 0]) for part in (motion.q, motion.dq, motion.ddq)]
            slave.setFloat64([references.q[0], references.dq[0], references.ddq[0]], inputs)
            if row == 0:
                slave.exitInitializationMode()
            else:
                slave.doStep((row - 1) * PERIOD, PERIOD)
            given.append(slave.getFloat64(shown))
        return given

    slave.instantiate()
    slave.enterInitializationMode()
    begun = driven(range(6))
    assert slave.getFloat64(shown) == begun[-1]  # to look at it changes nothing
    kept = slave.getFMUState()
    once = driven(range(6, 12))
    slave.setFMUState(kept)
    assert driven(range(6, 12)) == once
    slave.freeFMUState(kept)
    slave.reset()
    slave.enterInitializationMode()
    assert driven(range(6)) == begun
    slave.terminate()
    slave.freeInstance()
