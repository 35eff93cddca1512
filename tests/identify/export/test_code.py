"""Exported code agrees with the identified model, in Python, in C as compiled, and in structured text as interpreted."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from identify.effects.catalogue import effects
from identify.effects.expression import parse
from identify.export.c_code import c_code
from identify.export.compiled import compiled_torque
from identify.export.exported_model import exported_model
from identify.export.expression_code import literal
from identify.export.python_code import python_code
from identify.export.record_error import Motion
from identify.export.structured_text import TAKEN, block_name, structured_text
from identify.export.write import export, module_torque, write_export
from identify.identification import identify
from identify.recording import InputError
from identify.results.certificate import Certificate
from identify.results.exported_model import ExportedModelDocument
from identify.simulation.torque_model import TorqueModel, Windows
from tests.identify.export.structured_text_interpreter import Block

COMPILER = shutil.which("cc") or shutil.which("gcc")


@pytest.fixture(scope="module")
def motion(plant):
    """Held-out motion: random states in a course of positions, so that presliding has a history."""
    random = np.random.default_rng(4)
    q = np.cumsum(random.uniform(-0.02, 0.02, (60, 1)), axis=0)
    dq, ddq = random.uniform(-1, 1, (60, 1)), random.uniform(-3, 3, (60, 1))
    payload = next(own for own in plant.payloads if own.mass > 0)
    return Motion(np.linspace(0, 6, 60), q, dq, ddq, None, payload)


def of_the_model(result, motion):
    """The identifier's own columns on that motion."""
    fitted = result.fitted if result.structured is None else result.structured.fitted
    entry = next(own for own in result.experiment.sessions if own.payload.name == motion.payload.name)
    model = TorqueModel(fitted, entry)
    start = fitted.record.facts(entry).start
    found = []
    memory = None
    for row in range(len(motion.q)):
        one = Windows(
            motion.t[row : row + 1] + start,
            motion.q[row : row + 1],
            motion.dq[row : row + 1],
            np.sign(motion.dq[row : row + 1]),
        )
        if memory is None:
            memory = model.started(one)
        else:
            memory = model.advanced(memory, motion.q[row - 1 : row], motion.q[row : row + 1])
        found.append(
            model.torque(
                Windows(one.time, one.q, one.dq, one.direction, memory=memory), motion.ddq[row : row + 1]
            )[0]
        )
    return np.array(found)


def without_payload_ratio(result, motion):
    """The ratio M_ae/M_aw corrects the declared payload, which an exported arm does not carry: judged without one."""
    bare = next(own for own in result.experiment.payloads if own.mass == 0)
    return Motion(motion.t, motion.q, motion.dq, motion.ddq, None, bare)


def test_the_python_module_is_the_model(result, motion):
    motion = without_payload_ratio(result, motion)
    model = exported_model(result)
    namespace = type("Module", (), {})()
    scope: dict = {}
    exec(compile(python_code(model), "exported", "exec"), scope)
    namespace.__dict__.update(scope)
    exact = of_the_model(result, motion)
    assert module_torque(namespace, model)(motion) == pytest.approx(exact, rel=1e-9, abs=1e-9)


@pytest.mark.skipif(COMPILER is None, reason="no C compiler on this machine")
def test_the_c_source_compiles_without_a_warning_and_is_the_model(result, motion, tmp_path):
    motion = without_payload_ratio(result, motion)
    model = exported_model(result)
    source, header = c_code(model, "arm-1")
    (tmp_path / "arm-1.c").write_text(source)
    (tmp_path / "arm-1.h").write_text(header)
    strict = [COMPILER, "-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only"]
    subprocess.run([*strict, str(tmp_path / "arm-1.c")], check=True, capture_output=True, text=True)
    torque_of = compiled_torque(COMPILER, tmp_path / "arm-1.c", "arm_1", model)
    assert torque_of(motion) == pytest.approx(of_the_model(result, motion), rel=1e-9, abs=1e-9)


def test_the_structured_text_is_the_model(result, motion):
    motion = without_payload_ratio(result, motion)
    block = Block(structured_text(exported_model(result), "arm-1"), "ARM_1")
    found = [
        block(Q=motion.q[row], DQ=motion.dq[row], DDQ=motion.ddq[row], T=float(motion.t[row]))["TORQUE"][(0,)]
        for row in range(len(motion.q))
    ]
    assert np.array(found)[:, None] == pytest.approx(of_the_model(result, motion), rel=1e-9, abs=1e-9)


def test_the_structured_text_is_opened_by_a_parser_of_the_standard_that_is_not_ours(plant):
    parse = pytest.importorskip("blark.parse", reason="blark, which parses IEC 61131-3, is not installed")
    text = structured_text(exported_model(identify(plant, "usual", ["stribeck", "presliding"])), "arm-1")
    parsed = parse.parse_source_code(text)
    assert parsed.exception is None
    kinds = [type(item).__name__ for item in parsed.transform().items]
    assert kinds[-1] == "FunctionBlock"
    assert set(kinds[:-1]) == {"Function"}
    broken = text.replace("END_IF;", "END_IFF;", 1).partition("FUNCTION_BLOCK")[0]
    assert parse.parse_source_code(broken).exception is not None


def test_effects_beside_eq_30_are_kept_with_their_memory_or_told_as_lost(plant):
    model = exported_model(identify(plant, "load-velocity", ["presliding", "elasticity"]))
    names = [torque.effect for torque in model.torques]
    assert {"load-velocity", "viscous", "offset", "presliding"} == set(names)
    assert [torque.effect for torque in model.memories] == ["presliding"]
    assert model.lost == (("elasticity", 0),)


@pytest.mark.parametrize("name", sorted(effects()))
def test_every_effect_with_formulas_has_one_for_each_column_that_parses(name):
    effect = effects()[name]
    tried = {
        "presliding_distance": 0.01,
        "rotor_inertia": 0.2,
        "stribeck_velocity": 0.1,
        "time_constant": 10.0,
        "across_sessions": 0.0,
        "exponent": 0.5,
        "from": -1.0,
        "to": 1.0,
        "knots": 5.0,
        "threshold": 1.0,
        "power": 2.0,
        "wave_number": 20.0,
    }
    constants = {"wave_number": 20.0} if "ripple" in name else tried
    formulas = effect.formulas(constants)
    if formulas is None:
        return
    further = dict.fromkeys(
        ("direction", "memory", "motor_velocity", "motor_acceleration", "motor_share"), None
    )
    values = {own: np.array([0.3]) for own in ("q", "dq", "ddq", "load", "torque", "t", "temp", *further)}
    for formula in formulas:
        assert np.isfinite(parse(formula, further)(values)).all()


@pytest.mark.parametrize("value", [0.0, 1.0, -2.5, 1e-300, 1.5e300, 3, 0.1, -1e-7])
def test_numbers_are_written_exactly_in_every_language(value):
    text = literal(value)
    assert eval(text) == value
    assert "." in text


def test_targets_are_written_whole_with_a_certificate(plant, tmp_path):
    result = identify(plant, "usual", ["stribeck"])
    for name in ("arm.py", "arm.c", "arm.st", "arm.json"):
        certificate = write_export(result, tmp_path / name)
        stored = Certificate.model_validate_json((tmp_path / f"{name}.certificate.json").read_text())
        assert stored == certificate
        (joint,) = certificate.joints
        assert joint.kept[0] == "rigid body"
        assert {"viscous", "coulomb", "offset", "stribeck"} <= set(joint.kept)
        assert joint.lost == ()
        # alike but for reversals, where the identifier knows the instant better than the sign of the velocity, and for
        # the payload's ratio
        assert joint.relative_error_export == pytest.approx(joint.relative_error_model, rel=0.2)
    assert (tmp_path / "arm.h").is_file()
    document = ExportedModelDocument.model_validate_json((tmp_path / "arm.json").read_text())
    assert [own.effect for own in document.torques] == ["viscous", "coulomb", "offset", "stribeck"]
    assert not [path.name for path in tmp_path.iterdir() if path.name.startswith(".")]


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
    shown = Block(structured_text(model, "arm"), "ARM")
    assert shown is not None
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


@pytest.mark.parametrize(
    ("target", "folder"),
    [
        ("arm.py", "arm.py"),
        ("arm.urdf", "arm.urdf.certificate.json"),
        ("arm.c", "arm.h"),
        ('a".c', None),
        ("a" * 300 + ".py", None),
    ],
)
def test_a_target_that_cannot_be_written_is_refused_before_anything_is(plant, tmp_path, target, folder):
    if folder is not None:
        (tmp_path / folder).mkdir()
    with pytest.raises(InputError, match="is a folder" if folder else "include|cannot be written"):
        write_export(identify(plant, "usual"), tmp_path / target)
    assert [path.name for path in tmp_path.iterdir()] == ([folder] if folder else [])


@pytest.mark.parametrize(("target", "there"), [("arm.urdf", "arm.urdf"), ("arm.c", "arm.h")])
def test_a_file_that_was_not_exported_is_not_written_over(plant, tmp_path, target, there):
    (tmp_path / there).write_text("the maker's own")
    with pytest.raises(InputError, match="was not exported by coulomb"):
        export(plant, tmp_path / target)
    assert (tmp_path / there).read_text() == "the maker's own"
    (tmp_path / there).write_text("")
    export(plant, tmp_path / target, "rigid")
    written = (tmp_path / target).read_text()
    export(plant, tmp_path / target, "usual")  # an export is written anew
    assert (tmp_path / target).read_text() != written


@pytest.mark.parametrize(
    ("stem", "name"),
    [
        ("arm-1", "ARM_1"),
        ("if", "MODEL_IF"),
        ("Load", "MODEL_LOAD"),
        ("a__b_ c", "A_B_C"),
        ("2nd", "MODEL_2ND"),
    ],
)
def test_the_block_s_name_is_one_that_the_standard_allows(stem, name):
    assert block_name(stem) == name


def test_no_name_inside_the_block_can_be_its_own(plant):
    text = structured_text(exported_model(identify(plant, "usual", ["presliding"])), "arm")
    declared = re.findall(r"^ +([A-Z_]+(?:, [A-Z_]+)*) :", text, flags=re.MULTILINE)
    assert {name for line in declared for name in line.split(", ")} <= TAKEN
