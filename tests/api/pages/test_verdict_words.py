"""The diagnosis of a joint in an operator's words."""

from __future__ import annotations

from api.pages.verdict_words import structure_words, verdict_of
from identify.results.diagnosis import JointDiagnosis, LeftoverStructure


def unexplained(
    missing: tuple[str, ...] = (), structure: tuple[LeftoverStructure, ...] = ()
) -> JointDiagnosis:
    """A joint of which something is left that the catalogue does not explain."""
    return JointDiagnosis(
        joint="j1",
        verdict="unexplained",
        missing=missing,
        candidates=(),
        evidence=(),
        where=(),
        noise_floor=None,
        structure=structure,
        superfluous=(),
    )


def test_an_unexplained_joint_tells_what_a_part_of_it_looks_like():
    said = verdict_of(unexplained(("joint-spring",)), None, {"joint-spring": "a spring"})
    assert said.kind == "unexplained"
    assert said.detail.endswith("A part of it looks like a spring.")
    plain = verdict_of(unexplained(), None, {})
    assert "looks like" not in plain.detail


def test_a_blow_is_told_as_something_that_happened_and_not_as_foretold():
    blow = LeftoverStructure(variables=("moments",), share=0.63, deviation=0.01, found=True)
    said = structure_words(unexplained(structure=(blow,)))
    assert said is not None
    assert "63" in said
    assert "in a few moments" in said
    assert "foretold" not in said


def test_noise_is_not_put_into_words():
    noise = LeftoverStructure(variables=("moments",), share=0.01, deviation=0.01, found=False)
    assert structure_words(unexplained(structure=(noise,))) is None
