"""A user's own effect: formulas are computed as written, and nothing else is ever run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import identify
from identify.effects.expression import load_own_effect, parse
from identify.estimation.requested_model import known_effects
from identify.recording.errors import InputError
from tests.identify.effects.motions import motion_of


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("sin(12*q) * sign(dq)", lambda q, dq: np.sin(12 * q) * np.sign(dq)),
        ("-q**2 + 3/2", lambda q, dq: -(q**2) + 1.5),
        ("max(0, dq) - min(q, 0.1)", lambda q, dq: np.maximum(0, dq) - np.minimum(q, 0.1)),
        ("exp(-abs(dq)/k) * cos(pi*q)", lambda q, dq: np.exp(-np.abs(dq) / 0.3) * np.cos(np.pi * q)),
    ],
)
def test_a_formula_is_computed_as_written(text, expected):
    q, dq = np.linspace(-1, 1, 50), np.linspace(2, -2, 50)
    values = {"q": q, "dq": dq, "k": np.asarray(0.3)}
    np.testing.assert_allclose(parse(text, {"k": None})(values), expected(q, dq), rtol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('true')",
        "().__class__",
        "q.shape",
        "[q for q in (1,2)]",
        "lambda: q",
        "open('x')",
        "q if dq else 1",
        "f'{q}'",
        "q; dq",
        "q = 1",
        "sin(q, dq)",
        "unknown * q",
        "'text'",
        "True",
        "",
        "(" * 300 + "q" + ")" * 300,
    ],
)
def test_what_is_no_formula_is_refused(text):
    with pytest.raises(ValueError, match=r"formula|allowed|neither|function|takes|longer"):
        parse(text, {})


@given(st.text(max_size=80))
def test_any_text_is_either_a_formula_or_refused(text):
    try:
        node = parse(text, {})
    except ValueError:
        return
    assert callable(node)


def test_a_wrong_file_is_refused_in_one_line_that_names_the_field(tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text("name: drag\ncolumns: ['speed * q']\n")
    with pytest.raises(InputError) as refused:
        load_own_effect(path)
    assert "own.yaml" in str(refused.value)
    assert "'speed'" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_misspelt_field_is_named_with_its_line_and_the_one_that_was_meant(tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text("name: drag\ncolums: ['dq']\n")
    with pytest.raises(InputError, match=r"own\.yaml line 2: colums: unknown field.*columns"):
        load_own_effect(path)


def test_an_own_effect_is_judged_like_those_of_the_catalogue(hidden_stretch):
    said = identify.diagnose(identify.load_experiment(hidden_stretch)).joints[0]
    assert said.missing[0].effect.name == "lean-on-bumper"
    assert said.verdict == "missing"


def test_the_direction_and_other_joints_positions_are_signals(tmp_path):
    path = tmp_path / "pull.yaml"
    path.write_text(
        "name: pull\ncolumns: ['direction * (q2 - rest)']\nconstants: {rest: {from: 0.5, to: 0.5, count: 1}}\n"
    )
    effect = load_own_effect(path)
    plain = motion_of()
    motion = motion_of(positions=np.column_stack([plain.q, 0.3 + 0.1 * plain.time]))
    expected = np.sign(plain.dq) * (0.1 * plain.time - 0.2)
    np.testing.assert_allclose(effect.columns(motion, {"rest": 0.5})[:, 0], expected, rtol=1e-12)
    assert effect.formulas({"rest": 0.5}) is None  # exported code sees one joint at a time


def test_the_position_of_a_joint_that_the_robot_does_not_have_is_refused(hidden_stretch, tmp_path):
    loaded = identify.load_experiment(hidden_stretch)
    path = tmp_path / "pull.yaml"
    path.write_text("name: pull\ncolumns: [q2]\n")
    with pytest.raises(InputError, match=r"pull\.yaml: columns: 'q2': the robot has 1 joint"):
        known_effects(replace(loaded, effects=(path,)))


@pytest.mark.parametrize("name", ["Gear-drag", "2nd", "gear drag", "reibung-ä", ""])
def test_a_name_that_is_none_is_refused_in_words(tmp_path, name):
    file = tmp_path / "own.yaml"
    file.write_text(f"name: '{name}'\ncolumns: [dq]\n", encoding="utf-8")
    with pytest.raises(
        InputError, match=r"name: use small letters without accents, digits and '-', a letter first"
    ):
        load_own_effect(file)
