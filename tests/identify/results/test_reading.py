"""Documents read back: those written now, and a model story that was stored before documents had a format."""

import json
from pathlib import Path

import pytest

from identify.recording import InputError
from identify.results.diagnosis import DiagnosisDocument
from identify.results.document import FORMAT
from identify.results.identification import IdentificationDocument
from identify.results.improvement import ImprovementDocument
from identify.results.next_experiment import NextExperimentDocument
from identify.results.reading import document_from_json, document_of, read_document

STORED = Path(__file__).parent / "stored-format-1"
"""Written by the version before documents had types: a joint without payload, its usual model (m1), the same with the effect
that it missed (m2) and the load-velocity model (m3); and what `improve` printed."""

KINDS = {
    "identification.json": IdentificationDocument,
    "diagnosis.json": DiagnosisDocument,
    "next-0.json": NextExperimentDocument,
    "improvement.json": ImprovementDocument,
}
FILES = sorted(file for file in STORED.rglob("*.json") if file.name in KINDS)


def without_added(new, old):
    """The new values as far as the old ones have them."""
    if isinstance(old, dict):
        return {key: without_added(new[key], value) for key, value in old.items()}
    if isinstance(old, list):
        return [without_added(*pair) for pair in zip(new, old, strict=True)]
    return new


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(STORED)))
def test_a_document_of_the_first_format_is_read_whole_and_written_in_the_present_one(file):
    old = json.loads(file.read_text())
    document = read_document(KINDS[file.name], file)
    new = document.to_json()
    assert without_added(new, old) == old
    assert list(without_added(new, old)) == [key for key in new if key in old]
    assert new["format"] == FORMAT
    assert document_from_json(type(document), document.json_text(), "again") == document


def stored(kind) -> dict:
    name = next(name for name, each in KINDS.items() if each is kind)
    return json.loads(next(file for file in FILES if file.name == name).read_text())


def test_a_document_of_a_newer_format_is_refused():
    values = stored(DiagnosisDocument) | {"format": FORMAT + 1}
    with pytest.raises(
        InputError, match=r"kept\.json: format: 3 is unknown; this version reads formats 1 to 2"
    ):
        document_of(DiagnosisDocument, values, "kept.json")


@pytest.mark.parametrize("kind", KINDS.values())
def test_an_unknown_key_is_refused_by_its_name(kind):
    with pytest.raises(InputError, match=r"kept\.json: .*colour: Extra inputs are not permitted"):
        document_of(kind, stored(kind) | {"colour": "red"}, "kept.json")


def test_what_is_wrong_deep_inside_is_named_with_its_place():
    values = stored(DiagnosisDocument)
    del values["joints"][0]["candidates"][2]["p_value"]
    with pytest.raises(
        InputError,
        match=r"kept\.json: .*`coulomb diagnose --json`: joints\.0\.candidates\.2\.p_value: Field required",
    ):
        document_of(DiagnosisDocument, values, "kept.json")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{]", r"kept\.json, line 1: not JSON"),
        ("[" * 200_000, r"kept\.json: no result: lists too deep within each other"),
        (f'{{"format": {"9" * 5000}}}', r"kept\.json: no result: .* a number of too many digits"),
        ("[1]", r"kept\.json: not a result of `coulomb identify --json`"),
        ('{"format": "new"}', r"kept\.json: format: 'new' is unknown"),
        ('{"format": true}', r"kept\.json: format: True is unknown"),
    ],
)
def test_what_is_no_document_is_refused_in_one_line(content, words):
    with pytest.raises(InputError, match=words) as refused:
        document_from_json(IdentificationDocument, content, "kept.json")
    assert "\n" not in str(refused.value)
