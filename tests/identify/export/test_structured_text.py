"""The exported structured text, as interpreted, agrees with the identified model and keeps to IEC 61131-3."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from identify.export.exported_model import exported_model
from identify.export.formula_torque import module_of, module_torque
from identify.export.iec61131.parser import Parser
from identify.export.structured_text import TAKEN, block_name, structured_text
from identify.export.structured_text_torque import structured_text_torque
from identify.identification import identify
from tests.identify.export.identified_torque import of_the_model, without_payload_ratio


def test_the_structured_text_is_the_model(result, motion, tmp_path):
    motion = without_payload_ratio(result, motion)
    (tmp_path / "arm-1.st").write_text(structured_text(exported_model(result), "arm-1"))
    found = structured_text_torque(tmp_path / "arm-1.st")(motion)
    assert found == pytest.approx(of_the_model(result, motion), rel=1e-9, abs=1e-9)


def test_the_payload_s_torque_is_that_of_the_python_module(result, motion, tmp_path):
    model = exported_model(result)
    (tmp_path / "arm.st").write_text(structured_text(model, "arm"))
    found = structured_text_torque(tmp_path / "arm.st")(motion)
    assert motion.payload.mass > 0
    assert found == pytest.approx(module_torque(module_of(model), model)(motion), rel=1e-9, abs=1e-9)


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


@pytest.mark.parametrize(
    ("stem", "name"),
    [
        ("arm-1", "ARM_1"),
        ("if", "MODEL_IF"),
        ("Load", "MODEL_LOAD"),
        ("a__b_ c", "A_B_C"),
        ("2nd", "MODEL_2ND"),
        ("END_IF", "MODEL_END_IF"),
        ("real_to_int", "MODEL_REAL_TO_INT"),
        ("hand_to_arm", "HAND_TO_ARM"),
    ],
)
def test_the_block_s_name_is_one_that_the_standard_allows(stem, name):
    assert block_name(stem) == name


def test_no_word_that_a_reader_of_codesys_and_twincat_keeps_for_itself_names_a_block():
    """blark's grammar lists them in its pattern of an identifier; none of its files is a list of ours."""
    blark = pytest.importorskip("blark", reason="blark is not installed")
    grammar = (Path(blark.__file__).parent / "iec.lark").read_text(encoding="utf-8")
    kept = re.search(r"^IDENTIFIER: .*?\(\?!\((.*?)\)", grammar, flags=re.MULTILINE)
    assert kept
    words = kept[1].split("|")
    assert "END_IF" in words
    assert [word for word in words if block_name(word) == word] == []


def test_two_models_stand_in_one_project(result, motion, tmp_path):
    """Their functions have the blocks' names before their own; a reader of the standard refuses two of one name."""
    model = exported_model(result)
    texts = [structured_text(model, stem) for stem in ("left-arm", "right-arm")]
    named = [set(re.findall(r"^FUNCTION(?:_BLOCK)? (\w+)", text, flags=re.MULTILINE)) for text in texts]
    assert named[0] == {name.replace("RIGHT", "LEFT") for name in named[1]}
    units = Parser("\n".join(texts), "project.st").units()
    assert set(units) == named[0] | named[1]
    called = [set(re.findall(r"\w+_(?:SIGN|TANH|FINITE)(?=\()", text)) for text in texts]
    for own, names in zip(called, named, strict=True):
        assert own <= names


def test_no_name_inside_the_block_can_be_its_own(plant):
    text = structured_text(exported_model(identify(plant, "usual", ["presliding"])), "arm")
    declared = re.findall(r"^ +([A-Z_]+(?:, [A-Z_]+)*) : ", text, flags=re.MULTILINE)
    assert {name for line in declared for name in line.split(", ")} <= TAKEN
