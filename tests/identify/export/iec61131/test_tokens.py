"""Words of a structured text."""

from __future__ import annotations

import pytest

from identify.export.iec61131.tokens import tokens
from identify.recording import InputError


def test_words_have_their_kind_and_line_and_case_has_no_meaning():
    text = "a := B1 + 1.5E-3; // x\n(* one (* inside *) *) /* and\nthis */ If 16#fF <> 2..3"
    assert [(word.kind, word.text, word.line) for word in tokens(text, "a.st")] == [
        ("name", "A", 1),
        ("sign", ":=", 1),
        ("name", "B1", 1),
        ("sign", "+", 1),
        ("real", "1.5E-3", 1),
        ("sign", ";", 1),
        ("name", "IF", 3),
        ("integer", "16#fF", 3),
        ("sign", "<>", 3),
        ("integer", "2", 3),
        ("sign", "..", 3),
        ("integer", "3", 3),
        ("end", "the end of the text", 3),
    ]


@pytest.mark.parametrize("text", ["a__b", "a_", "1a", "1.5x", "ä", "(* (* *)", '"text'])
def test_what_is_no_word_is_refused_with_its_line(text):
    with pytest.raises(InputError, match=r"^a\.st line 2: "):
        tokens(f"x\n{text}", "a.st")
