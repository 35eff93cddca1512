"""A unit that FMPy steps along a motion: each row a step, its latency given and taken off; what it cannot be is said."""

from __future__ import annotations

import shutil
from zipfile import ZipFile

import numpy as np
import pytest

from identify.export.exported_model import exported_model
from identify.export.fmu import fmu
from identify.export.fmu_torque import fmu_torque
from identify.export.formula_torque import module_of, module_torque
from identify.export.record_error import Motion
from identify.identification import identify
from identify.recording import InputError
from tests.identify.export.derivatives import PERIOD, one_inertia, sine
from tests.identify.export.identified_torque import of_the_model, without_payload_ratio

pytest.importorskip("fmpy", reason="FMPy (extra fmu) is not installed")

COMPILER = shutil.which("cc") or shutil.which("gcc")

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler on this machine")


@pytest.fixture(scope="module")
def late(plant):
    """One inertia whose torque comes 1 ms behind its motion: it is known a sample later."""
    return one_inertia(exported_model(identify(plant, "usual")), 1.5, [("delay", "-torque", 1e-3, 1)])


@pytest.fixture
def late_unit(late, tmp_path):
    path = tmp_path / "late.fmu"
    path.write_bytes(fmu(late, "late", COMPILER))
    return path


def held_out_motion(plant, rows=60):
    """Random states in a course of positions, so that presliding has a history."""
    random = np.random.default_rng(8)
    q = np.cumsum(random.uniform(-0.02, 0.02, (rows, 1)), axis=0)
    dq, ddq = random.uniform(-1, 1, (rows, 1)), random.uniform(-3, 3, (rows, 1))
    payload = next(own for own in plant.payloads if own.mass > 0)
    return Motion(np.linspace(0, 6, rows), q, dq, ddq, None, payload)


def test_the_unit_is_the_model_on_held_out_motion(result, tmp_path):
    unit = tmp_path / "arm-1.fmu"
    unit.write_bytes(fmu(exported_model(result), "arm-1", COMPILER))
    motion = without_payload_ratio(result, held_out_motion(result.experiment))
    found = fmu_torque(unit)(motion)
    assert found == pytest.approx(of_the_model(result, motion), rel=1e-9, abs=1e-9)


def test_a_unit_with_a_latency_gives_each_row_its_own_torque_at_whatever_steps(late, late_unit, plant):
    """At 1 ms and then at 3 ms; a second motion begins anew, with another payload."""
    torque_of, formulas = fmu_torque(late_unit), module_torque(module_of(late), late)
    time = np.concatenate([np.arange(20) * PERIOD, 20 * PERIOD + np.arange(20) * 3 * PERIOD])
    for payload in plant.payloads:
        motion = sine(payload, time)
        expected = formulas(motion)
        assert torque_of(motion) == pytest.approx(expected, rel=1e-8, abs=1e-8)
        behind = 1.5 * sine(payload, time - 1e-3).ddq
        if payload.mass == 0:
            assert np.abs(expected - behind)[2:-2].max() < 0.1 * np.abs(1.5 * motion.ddq - behind).max()


def described_otherwise(unit, old, new):
    """The same unit with something else in its description."""
    path = unit.with_name("other.fmu")
    with ZipFile(unit) as archive, ZipFile(path, "w") as changed:
        for name in archive.namelist():
            data = archive.read(name)
            if name == "modelDescription.xml":
                assert old.encode() in data
                data = data.replace(old.encode(), new.encode())
            changed.writestr(name, data)
    return path


def test_what_is_no_unit_or_not_such_a_one_is_refused_in_a_line(late_unit, plant, tmp_path):
    (tmp_path / "none.fmu").write_bytes(b"no archive")
    with pytest.raises(InputError, match=r"^none\.fmu: FMPy does not take it: .+$"):
        fmu_torque(tmp_path / "none.fmu")
    nameless = described_otherwise(late_unit, 'name="payload_MX"', 'name="payload_MQ"')
    with pytest.raises(InputError, match=r"^other\.fmu: the unit has no variable 'payload_MX'$"):
        fmu_torque(nameless)
    stranger = described_otherwise(late_unit, 'instantiationToken="', 'instantiationToken="0')
    with pytest.raises(InputError, match=r"^other\.fmu: FMPy could not run it: .+$"):
        fmu_torque(stranger)(sine(plant.payloads[0], np.arange(3) * PERIOD))
