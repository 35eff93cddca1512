"""C sources are compiled, and what the compiler says of one that is wrong is said in one line."""

from __future__ import annotations

import ctypes

import pytest

from identify.export.compiled import compile_library, compiler_here
from identify.recording import InputError

COMPILER = compiler_here()
pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler on this machine")


def test_several_sources_become_one_library_with_the_mathematics_of_c(tmp_path):
    (tmp_path / "a.c").write_text("#include <math.h>\ndouble root(double x) { return sqrt(x); }\n")
    (tmp_path / "b.c").write_text("double root(double); double fourth(double x) { return root(root(x)); }\n")
    compile_library(COMPILER, [tmp_path / "a.c", tmp_path / "b.c"], tmp_path / "both.so")
    fourth = ctypes.CDLL(str(tmp_path / "both.so")).fourth
    fourth.argtypes, fourth.restype = [ctypes.c_double], ctypes.c_double
    assert fourth(81.0) == 3.0


def test_a_source_that_the_compiler_refuses_is_named_with_its_first_line(tmp_path):
    (tmp_path / "arm.c").write_text("int broken(\n")
    with pytest.raises(InputError, match=r"arm\.c: .* could not compile it: .*arm\.c:") as refused:
        compile_library(COMPILER, [tmp_path / "arm.c"], tmp_path / "arm.so")
    assert "\n" not in str(refused.value)
