"""The functional mock-up unit as FMPy sees it: description and sources by the standard, torque by the model."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

from identify.export import loaded_back, write
from identify.export.exported_model import exported_model
from identify.export.fmi_source import ValueReferences
from identify.export.fmu import fmu
from identify.identification import identify
from identify.recording import InputError

fmpy = pytest.importorskip("fmpy", reason="FMPy (extra fmu) is not installed")

FMU3Slave = pytest.importorskip("fmpy.fmi3").FMU3Slave
validate_fmu = pytest.importorskip("fmpy.validation").validate_fmu

COMPILER = shutil.which("cc") or shutil.which("gcc")
HEADERS = Path(fmpy.__file__).parent / "c-code"

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler on this machine")


@pytest.fixture
def unit(result, tmp_path):
    path = tmp_path / "arm-1.fmu"
    path.write_bytes(fmu(exported_model(result), "arm-1", COMPILER))
    return path


def test_fmpy_finds_nothing_wrong_with_the_unit(unit):
    """Schemas of model and build description, names, units, structure, files."""
    assert validate_fmu(str(unit)) == []
    description = fmpy.read_model_description(
        unit, validate=True, validate_variable_names=True, validate_model_structure=True
    )
    assert description.fmiVersion == "3.0"
    shown = {variable.name: (variable.causality, variable.unit) for variable in description.modelVariables}
    assert shown["q1"] == ("input", "rad")
    assert shown["torque1"] == ("output", "N.m")
    assert shown["payload_MX"] == ("parameter", "kg.m")


def test_the_binary_shows_the_functions_of_the_standard_and_nothing_else(unit, tmp_path):
    """Two units of one name in one program: neither may call the other's model."""
    folder = Path(fmpy.extract(unit, tmp_path / "unpacked"))
    (binary,) = (folder / "binaries").rglob("arm_1.*")
    library = ctypes.CDLL(str(binary))
    assert library.fmi3GetVersion is not None
    for own in ("arm_1_torque", "arm_1_rigid_torque", "arm_1_memory_after"):
        assert not hasattr(library, own)


@pytest.mark.parametrize("headers", [True, False], ids=["with the standard's headers", "by themselves"])
def test_the_sources_compile_without_a_warning(unit, tmp_path, headers):
    fmpy.extract(unit, tmp_path / "unpacked")
    found = ["-isystem", str(HEADERS)] if headers else []
    strict = [COMPILER, "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only", *found]
    for source in ("arm_1.c", "arm_1_fmi3.c"):
        subprocess.run(
            [*strict, str(tmp_path / "unpacked/sources" / source)], check=True, capture_output=True
        )


def test_an_importer_simulates_the_unit_with_inputs_over_time(result, unit):
    """FMPy's own master, which holds each input over the step that follows."""
    times = np.linspace(0.0, 0.1, 11)
    speed = np.sin(3.0 * times)
    given = np.array(
        list(zip(times, 0.2 * times, speed, strict=True)),
        dtype=[("time", float), ("q1", float), ("dq1", float)],
    )
    recorded = fmpy.simulate_fmu(
        unit, stop_time=0.1, step_size=0.01, output_interval=0.01, input=given, output=["torque1"]
    )
    assert np.isfinite(recorded["torque1"]).all()
    assert np.ptp(recorded["torque1"]) > 0


def test_a_state_that_was_kept_is_gone_back_to(result, unit, tmp_path):
    """What a master does that tries a step and takes it back, in memory and as bytes."""
    model = exported_model(result)
    references = ValueReferences(model)
    description = fmpy.read_model_description(unit)
    slave = FMU3Slave(
        guid=description.guid,
        unzipDirectory=fmpy.extract(unit, tmp_path / "unpacked"),
        modelIdentifier="arm_1",
        instanceName="tried",
    )
    slave.instantiate()
    slave.enterInitializationMode()
    slave.setFloat64([*references.q, *references.dq], [0.1, 0.5])
    slave.exitInitializationMode()
    shown = [*references.q, *references.torque, *references.states]
    before, kept = slave.getFloat64(shown), slave.getFMUState()
    written = slave.serializeFMUState(kept)
    for again in (kept, slave.deserializeFMUState(written)):
        slave.setFloat64([*references.q, *references.dq], [0.09, -0.5])
        slave.doStep(0.0, 0.01)
        assert slave.getFloat64(shown) != before
        slave.setFMUState(again)
        assert slave.getFloat64(shown) == before
        slave.freeFMUState(again)
    slave.terminate()
    slave.freeInstance()


def test_values_that_are_none_and_references_that_do_not_exist_are_refused(result, unit, tmp_path):
    references = ValueReferences(exported_model(result))
    description = fmpy.read_model_description(unit)
    said = []
    slave = FMU3Slave(
        guid=description.guid,
        unzipDirectory=fmpy.extract(unit, tmp_path / "unpacked"),
        modelIdentifier="arm_1",
        instanceName="tried",
    )
    slave.instantiate(logMessage=lambda environment, status, category, message: said.append(message.decode()))
    refused = [
        lambda: slave.setFloat64([references.q[0]], [float("nan")]),
        lambda: slave.setFloat64([references.torque[0]], [1.0]),
        lambda: slave.getFloat64([references.states.stop]),
        lambda: slave.getBoolean([1]),
        lambda: slave.doStep(0.0, 0.0),
    ]
    for call in refused:
        with pytest.raises(fmpy.fmi1.FMICallException):
            call()
    assert [words.split(":")[0] for words in said] == [
        "a value is not finite",
        "this value reference cannot be set",
        "there is no such value reference",
        "fmi3GetBoolean",
        "a step must be longer than zero",
    ]
    slave.freeInstance()
    stranger = FMU3Slave(
        guid="0" * 32,
        unzipDirectory=str(tmp_path / "unpacked"),
        modelIdentifier="arm_1",
        instanceName="stranger",
    )
    with pytest.raises(Exception, match="instantiate"):
        stranger.instantiate(logMessage=lambda *_: None)
    stranger.freeLibrary()


def test_the_same_model_is_the_same_file(result, unit):
    assert fmu(exported_model(result), "arm-1", COMPILER) == unit.read_bytes()
    with ZipFile(BytesIO(unit.read_bytes())) as archive:
        assert archive.testzip() is None


def test_the_certificate_is_measured_by_fmpy_or_says_that_it_is_not(plant, tmp_path, monkeypatch):
    result = identify(plant, "usual", ["presliding"])
    stepped = write.write_export(result, tmp_path / "arm.fmu")
    assert stepped.checked_with == "the unit, stepped by FMPy"
    assert stepped.joints[0].lost == ()
    assert [
        path.name for path in tmp_path.iterdir() if path.name not in ("arm.fmu", "arm.fmu.certificate.json")
    ] == []
    assert stepped.joints[0].relative_difference < 1e-12
    monkeypatch.setattr(loaded_back, "has_fmpy", lambda: False)
    not_run = write.write_export(result, tmp_path / "arm.fmu")
    assert "FMPy is not installed; install the extra" in not_run.not_measured
    assert not_run.joints[0].relative_error_export is None
    monkeypatch.setattr(loaded_back, "compiler_here", lambda: None)
    monkeypatch.setattr(write, "compiler_here", lambda: None)
    sources = write.write_export(result, tmp_path / "arm.fmu")
    assert "sources and no binary" in sources.not_measured
    assert "no C compiler" in sources.not_measured
    assert sources.joints[0].relative_error_export is None
    with ZipFile(tmp_path / "arm.fmu") as archive:
        assert {name.partition("/")[0] for name in archive.namelist()} == {
            "modelDescription.xml",
            "sources",
            "documentation",
        }


def test_a_compiler_that_refuses_is_said(plant):
    with pytest.raises(InputError, match="could not compile"):
        fmu(exported_model(identify(plant, "usual")), "arm", shutil.which("false"))
