"""The exported Python module agrees with the identified model."""

from __future__ import annotations

import ast
import shutil
import subprocess
from dataclasses import replace

import pytest

from identify.export.c_code import c_code
from identify.export.exported_model import exported_model
from identify.export.formula_torque import module_torque
from identify.export.iec61131.function_block import FunctionBlock
from identify.export.python_code import python_code
from identify.export.structured_text import structured_text
from identify.identification import identify
from tests.identify.export.identified_torque import of_the_model, without_payload_ratio

COMPILER = shutil.which("cc") or shutil.which("gcc")


def test_the_python_module_is_the_model(result, motion):
    motion = without_payload_ratio(result, motion)
    model = exported_model(result)
    namespace = type("Module", (), {})()
    scope: dict = {}
    exec(compile(python_code(model), "exported", "exec"), scope)
    namespace.__dict__.update(scope)
    exact = of_the_model(result, motion)
    assert module_torque(namespace, model)(motion) == pytest.approx(exact, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    "name",
    [
        'Übung "A"',
        "ends with \\",
        "a\\N{x}",
        '"""\nraise SystemExit(1)\n"""',
        "a*/ b /* c",
        "(* a *) b",
        "two\nlines\r\x00\x85",
    ],
)
def test_a_name_of_an_experiment_or_joint_stays_a_comment(plant, name, tmp_path):
    model = exported_model(identify(plant, "usual"))
    base = replace(model.base, geometry=replace(model.geometry, names=(name,)))
    model = replace(model, experiment=name, base=base)
    text = python_code(model)
    tree = ast.parse(text)
    assert ast.unparse(tree.body[1]) == "import numpy as np"
    assert ast.get_docstring(tree).startswith("Inverse dynamics of " + name[:1])
    assert FunctionBlock(structured_text(model, "arm"), "arm.st").inputs()[0] == "Q"
    comments = structured_text(model, "arm").split("\nFUNCTION", 1)[0]
    assert comments.count("(*") == comments.count("*)") == 1
    if COMPILER is not None:
        source, header = c_code(model, "arm")
        (tmp_path / "arm.c").write_text(source, encoding="utf-8")
        (tmp_path / "arm.h").write_text(header, encoding="utf-8")
        strict = [
            COMPILER,
            "-std=c99",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-pedantic",
            "-c",
            "-o",
            "arm.o",
            "arm.c",
        ]
        subprocess.run(strict, check=True, capture_output=True, cwd=tmp_path)
