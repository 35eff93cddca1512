"""The exported C, as compiled, agrees with the identified model."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from identify.export.c_code import c_code
from identify.export.compiled import compiled_torque
from identify.export.exported_model import exported_model
from identify.identification import identify
from tests.identify.export.identified_torque import of_the_model, without_payload_ratio

COMPILER = shutil.which("cc") or shutil.which("gcc")


@pytest.mark.skipif(COMPILER is None, reason="no C compiler on this machine")
def test_the_c_source_compiles_without_a_warning_and_is_the_model(result, motion, tmp_path):
    motion = without_payload_ratio(result, motion)
    model = exported_model(result)
    source, header = c_code(model, "arm-1")
    (tmp_path / "arm-1.c").write_text(source)
    (tmp_path / "arm-1.h").write_text(header)
    for standard in ("c99", "c11", "c17"):
        strict = [COMPILER, f"-std={standard}", "-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only"]
        subprocess.run([*strict, str(tmp_path / "arm-1.c")], check=True, capture_output=True, text=True)
    torque_of = compiled_torque(COMPILER, tmp_path / "arm-1.c")
    assert torque_of(motion) == pytest.approx(of_the_model(result, motion), rel=1e-9, abs=1e-9)


CALLER = """#include "arm.h"
#include <stdio.h>
int main(void) {
    double q[ARM_JOINTS] = {0.1}, dq[ARM_JOINTS] = {0}, ddq[ARM_JOINTS] = {0}, torque[ARM_JOINTS];
    double memory[ARM_MEMORIES + 1], temperature[ARM_JOINTS] = {300.0}, payload[10] = {0};
    arm_torque(q, dq, ddq, 0.0, NULL, NULL, NULL, torque);
    dq[0] = -1e300;
    arm_memory_at_start(dq, memory);
    arm_memory_after(memory, q, dq);
    arm_torque(q, dq, ddq, -1.0, temperature, memory, payload, torque);
    printf("%d\\n", ARM_JOINTS);
    return 0;
}
"""


@pytest.mark.skipif(COMPILER is None, reason="no C compiler on this machine")
def test_the_source_does_nothing_that_c_leaves_undefined_and_its_header_is_c_plus_plus_too(plant, tmp_path):
    source, header = c_code(
        exported_model(identify(plant, "usual", ["presliding", "friction-warmup"])), "arm"
    )
    for name, text in (("arm.c", source), ("arm.h", header), ("main.c", CALLER)):
        (tmp_path / name).write_text(text)
    checked = ["-fsanitize=undefined", "-fno-sanitize-recover=all", "-g"]
    built = subprocess.run(
        [COMPILER, "-std=c99", *checked, "-o", "main", "main.c", "arm.c", "-lm"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    if built.returncode != 0 and "ubsan" in built.stderr:
        pytest.skip("the compiler has no sanitizer of undefined behaviour")
    assert built.returncode == 0, built.stderr
    ran = subprocess.run([str(tmp_path / "main")], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "1\n", "")
    compiler = shutil.which("c++") or shutil.which("g++")
    if compiler is not None:
        (tmp_path / "user.cpp").write_text('#include "arm.h"\nauto *torque = &arm_torque;\n')
        strict = [
            compiler,
            "-std=c++17",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-pedantic",
            "-fsyntax-only",
            "user.cpp",
        ]
        subprocess.run(strict, cwd=tmp_path, check=True, capture_output=True)
