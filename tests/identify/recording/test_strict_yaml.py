"""The strict reader of YAML against JSON, of which YAML 1.2 is a superset, and against what YAML 1.1 would make of a word."""

import json

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from identify.recording.errors import InputError
from identify.recording.strict_yaml import (
    DEEPEST,
    LONGEST_WHOLE_NUMBER,
    MOST_VALUES,
    parse_strict_yaml,
    read_strict_yaml,
    strict_yaml_text,
)

SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-(10**15), 10**15)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(codec="ascii", exclude_categories=["Cc"]), max_size=12)
)
DOCUMENTS = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.text("abcdefgh", min_size=1, max_size=4), inner, max_size=4)
    ),
    max_leaves=12,
)


@given(DOCUMENTS)
def test_a_document_in_json_is_read_as_json_reads_it(document):
    text = json.dumps(document)
    assert parse_strict_yaml(text, "file")[0] == json.loads(text)


@pytest.mark.parametrize(
    "word", ["yes", "no", "on", "off", "0x1F", "1_000", "12:30:00", "2026-11-28", "1e", "+", "."]
)
def test_words_that_yaml_1_1_takes_for_something_else_stay_words(word):
    assert parse_strict_yaml(f"name: {word}", "file")[0] == {"name": word}


def test_each_field_has_its_line():
    text = "# robot\nrobot:\n  joints:\n    - name: j1\n      type: revolute\n\ngravity: [0,\n  9.81]\n"
    document, lines = parse_strict_yaml(text, "file")
    assert document == {"robot": {"joints": [{"name": "j1", "type": "revolute"}]}, "gravity": [0, 9.81]}
    assert lines["robot",] == 2
    assert lines["robot", "joints", 0, "type"] == 5
    assert lines["gravity",] == 7
    assert lines["gravity", 1] == 8


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: 2\na: 3\n", "file line 3: 'a' occurs twice (first in line 1); keep one"),
        ("a:\n  - 1\n\t- 2\n", "file line 3: not valid YAML: a tab; indent with spaces"),
        ("? [1, 2]\n: 3\n", "file line 1: a key must be a plain word"),
        (
            "a: !!python/name:os.system x\n",
            "file line 1: the tag tag:yaml.org,2002:python/name:os.system is not used",
        ),
        (f"a: {'9' * (LONGEST_WHOLE_NUMBER + 1)}\n", "file line 1: 99999999999999999999"[:30]),
    ],
)
def test_what_is_not_taken_is_named_with_its_line(text, message):
    with pytest.raises(InputError) as refused:
        parse_strict_yaml(text, "file")
    assert str(refused.value).startswith(message)


def test_the_longest_whole_number_is_still_one():
    digits = "9" * LONGEST_WHOLE_NUMBER
    assert parse_strict_yaml(digits, "file")[0] == int(digits)


def test_aliases_that_stand_for_billions_of_values_end_at_the_most_that_a_file_of_settings_holds():
    text = "a0: &a0 [1, 1]\n" + "".join(
        f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]\n" for k in range(1, 10)
    )
    with pytest.raises(InputError, match=f"more than {MOST_VALUES} values"):
        parse_strict_yaml(text, "file")


@pytest.mark.parametrize(
    "text",
    [
        "a: " + "[" * 100_000,
        "a: " + "{a: " * 5000 + "1" + "}" * 5000,
        "- " * 5000 + "1",
        "a: &a [*a]",
        "a: &a {b: [*a]}",
    ],
    ids=["lists", "mappings", "blocks", "a list in itself", "a mapping in itself"],
)
def test_what_lies_within_itself_or_too_deep_is_refused_with_its_line(text):
    """libyaml's composer ends the program, service and all, at some tens of thousands of brackets."""
    with pytest.raises(
        InputError, match=f"^file line 2: more than {DEEPEST} lists and mappings within each other"
    ):
        parse_strict_yaml(f"# made\n{text}\n", "file")


def test_lists_as_deep_as_they_may_be_are_read():
    text = "[" * DEEPEST + "]" * DEEPEST
    assert parse_strict_yaml(text, "file")[0] == json.loads(text)


def test_a_file_that_is_not_text_is_named_with_the_line_where_it_ceases_to_be(tmp_path):
    file = tmp_path / "experiment.yaml"
    file.write_bytes("\ufeffa: 1\nb: 2\n".encode() + b"c: \xff\n")
    with pytest.raises(InputError, match="line 3: not UTF-8"):
        read_strict_yaml(file)
    file.write_bytes("\ufeffa: 1\n".encode())
    assert read_strict_yaml(file)[0] == {"a": 1}


@given(DOCUMENTS, st.booleans())
def test_what_is_written_is_read_as_it_was_by_this_reader_and_by_pyyaml(document, lists_in_line):
    text = strict_yaml_text(document, lists_in_line=lists_in_line)
    assert parse_strict_yaml(text, "x")[0] == document
    assert yaml.safe_load(text) == document


@pytest.mark.parametrize(
    "word", ["08", "09", "00", "1e3", "1_000", "yes", "~", "", "12:30", ".5", "+1", "0x1f", "2026-11-28"]
)
def test_a_name_that_looks_like_a_number_stays_a_name(word):
    """The ninth proof of an experiment is called 08, which PyYAML takes for a word and YAML 1.2 for eight."""
    assert parse_strict_yaml(strict_yaml_text({"name": word}), "x")[0] == {"name": word}
