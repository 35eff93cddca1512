"""The exported C of a model with derivatives over time, as a compiler sees it."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from identify.export.compiled import compiler_here


@pytest.mark.skipif(compiler_here() is None, reason="no C compiler on this machine")
def test_the_c_source_has_no_warning_and_its_header_is_c_plus_plus_too(all_formats):
    folder, _ = all_formats
    strict = ["-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only"]
    for standard in ("c99", "c17"):
        command = [compiler_here(), f"-std={standard}", *strict, str(folder / "arm.c")]
        subprocess.run(command, check=True, capture_output=True)
    if (compiler := shutil.which("c++")) is not None:
        (folder / "user.cpp").write_text('#include "arm.h"\nauto *step = &arm_step;\narm_cycles cycles;\n')
        subprocess.run([compiler, *strict, str(folder / "user.cpp")], check=True, capture_output=True)
