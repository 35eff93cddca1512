"""The diagnosis of a joint in an operator's words."""

from __future__ import annotations

from api.pages.verdict_words import structure_words, verdict_of


def test_an_unexplained_joint_tells_what_a_part_of_it_looks_like():
    said = verdict_of(
        {"verdict": "unexplained", "missing": ["joint-spring"]}, None, {"joint-spring": "a spring"}
    )
    assert said.kind == "unexplained"
    assert said.detail.endswith("A part of it looks like a spring.")
    plain = verdict_of({"verdict": "unexplained", "missing": []}, None, {})
    assert "looks like" not in plain.detail


def test_a_blow_is_told_as_something_that_happened_and_not_as_foretold():
    blow = {"variables": ["moments"], "share": 0.63, "deviation": 0.01, "found": True}
    said = structure_words({"missing": [], "structure": [blow]})
    assert said is not None
    assert "63" in said
    assert "in a few moments" in said
    assert "foretold" not in said


def test_noise_is_not_put_into_words():
    noise = {"variables": ["moments"], "share": 0.01, "deviation": 0.01, "found": False}
    assert structure_words({"missing": [], "structure": [noise]}) is None
