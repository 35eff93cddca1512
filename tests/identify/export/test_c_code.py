"""The exported C, as compiled, agrees with the identified model."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from identify.export.c_code import c_code
from identify.export.compiled import compiled_torque
from identify.export.exported_model import exported_model
from tests.identify.export.identified_torque import of_the_model, without_payload_ratio

COMPILER = shutil.which("cc") or shutil.which("gcc")


@pytest.mark.skipif(COMPILER is None, reason="no C compiler on this machine")
def test_the_c_source_compiles_without_a_warning_and_is_the_model(result, motion, tmp_path):
    motion = without_payload_ratio(result, motion)
    model = exported_model(result)
    source, header = c_code(model, "arm-1")
    (tmp_path / "arm-1.c").write_text(source)
    (tmp_path / "arm-1.h").write_text(header)
    strict = [COMPILER, "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only"]
    subprocess.run([*strict, str(tmp_path / "arm-1.c")], check=True, capture_output=True, text=True)
    torque_of = compiled_torque(COMPILER, tmp_path / "arm-1.c")
    assert torque_of(motion) == pytest.approx(of_the_model(result, motion), rel=1e-9, abs=1e-9)
