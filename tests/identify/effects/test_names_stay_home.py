"""An effect's name stands in its own file: whatever hangs on it is declared there, and the others ask the effect."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from identify.effects.catalogue import ORDER, built_in

ROOT = Path(__file__).parents[3]

ALLOWED = {
    "identify/effects/catalogue.py": "the contract's names in its order; one that is not there comes behind",
    "identify/effects/model.py": "the contract's named models are lists of effects",
    "drivers/simulated": "the simulated plant says the contract's names for what it hides and shares no line with identify",
    "daq/recording_file.py": "`offset` is an attribute of the recorded positions, not the effect",
    "identify/recording/session_hdf5.py": "`offset` is an attribute of the recorded positions, not the effect",
    "api/drive_tables.py": "a drive's tables hold one ripple and one constant, whatever else the catalogue knows",
    "api/pages/number_format.py": "`delay` is the parameter's name, beside the symbols of the other constants",
    "api/planned_motion.py": "`offset` is the parameter's name, beside FV and FC of eq. (8)",
    "identify/export/fmu.py": "`offset` is an attribute of a unit in FMI's description, not the effect",
    "identify/simulation/controller.py": "`offset` is a constant of the controller",
}
"""Files that name effects all the same, each with the reason."""

PROGRAM = {"coulomb"}
"""The program is called as one of the effects is."""


def rooms() -> list[Path]:
    return [
        path
        for room in ("api", "daq", "drivers", "identify")
        for path in sorted((ROOT / room).rglob("*.py"))
        if "node_modules" not in path.parts
    ]


def examples_of(tree: ast.AST) -> set[int]:
    """Strings that only document: docstrings, and what stands in `examples=` of a field."""
    ids: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.keyword) and node.arg == "examples":
            ids |= {id(each) for each in ast.walk(node.value)}
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            ids.add(id(node.value))
    return ids


def names_in(path: Path, names: set[str]) -> set[str]:
    """Names of effects that the code of a file holds as strings, with or without a joint."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    examples = examples_of(tree)
    return {
        node.value.split("@")[0]
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and id(node) not in examples
        and node.value.split("@")[0] in names
    }


def test_no_other_source_file_names_an_effect():
    names = {effect.name for effect in built_in()} - PROGRAM
    elsewhere = {}
    for path in rooms():
        relative = path.relative_to(ROOT).as_posix()
        if any(relative == allowed or relative.startswith(f"{allowed}/") for allowed in ALLOWED):
            continue
        inside = relative.startswith("identify/effects/")
        if not inside and (named := names_in(path, names)):
            elsewhere[relative] = sorted(named)
    assert elsewhere == {}


@pytest.mark.parametrize("allowed", ALLOWED)
def test_what_is_allowed_is_still_needed(allowed):
    names = {effect.name for effect in built_in()}
    place = ROOT / allowed
    assert any(names_in(path, names) for path in ([place] if place.is_file() else place.rglob("*.py")))


def test_effects_name_each_other_only_as_confusable():
    """Within the room a name in another's file stands in `confusable` alone; relations use the class."""
    names = {effect.name for effect in built_in()}
    for effect in built_in():
        assert set(effect.confusable) <= names - {effect.name}
    for path in (ROOT / "identify" / "effects").glob("*.py"):
        relative = path.relative_to(ROOT).as_posix()
        if relative in ALLOWED:
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        confusable = {
            id(each)
            for node in ast.walk(tree)
            if isinstance(node, ast.Assign)
            and any(
                isinstance(target, ast.Name) and target.id in ("confusable", "name")
                for target in node.targets
            )
            for each in ast.walk(node.value)
        }
        loose = {
            node.value
            for node in ast.walk(tree)
            if isinstance(node, ast.Constant)
            and node.value in names
            and id(node) not in confusable | examples_of(tree)
        }
        # the name of a parameter or constant may be the same word
        assert loose <= {"offset", "delay"}, relative


def test_the_names_that_others_rely_on_are_there():
    assert set(ORDER) <= {effect.name for effect in built_in()}
