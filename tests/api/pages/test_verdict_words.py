"""The diagnosis of a joint in an operator's words."""

from __future__ import annotations

from api.pages.error_figures import JointUnits
from api.pages.number_format import THIN
from api.pages.verdict_words import structure_words, verdict_of, where_words
from identify.results.diagnosis import JointDiagnosis, LeftoverStructure, Where


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


def test_what_two_joints_do_together_looks_like_a_motor_that_they_share():
    both = LeftoverStructure(variables=("dq", "dq of j2"), share=0.86, deviation=0.01, found=True)
    said = structure_words(unexplained(structure=(both,)))
    assert said is not None
    assert "predicted from speed and speed of j2" in said
    assert said.endswith("It looks like friction of a motor or a belt that both joints share.")
    alone = LeftoverStructure(variables=("dq", "load"), share=0.86, deviation=0.01, found=True)
    assert "share." not in (structure_words(unexplained(structure=(alone,))) or "")


def test_noise_is_not_put_into_words():
    noise = LeftoverStructure(variables=("moments",), share=0.01, deviation=0.01, found=False)
    assert structure_words(unexplained(structure=(noise,))) is None


def test_what_happened_once_is_placed_by_the_time_of_its_session():
    blow = Where(
        variable="time",
        from_=117.02,
        to=117.43,
        label="session-01.csv",
        share_of_error=0.9,
        share_of_samples=0.01,
        excess=0.89,
    )
    said = where_words(blow, JointUnits.of("revolute")).replace(THIN, " ")
    assert said == "time 117.0 to 117.4 s of session-01.csv"
    pooled = where_words(blow.model_copy(update={"label": None}), JointUnits.of("revolute"))
    assert "session-01.csv" not in pooled
