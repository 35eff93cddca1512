"""A diagnosis and an improvement in the terminal: verdicts, candidates with their evidence, and what is offered."""

from __future__ import annotations

import pytest

from api.diagnosis_text import SHOWN, diagnosis_text, improvement_text
from identify.results.diagnosis import (
    Candidate,
    DiagnosisDocument,
    JointDiagnosis,
    Learned,
    LeftoverStructure,
    Where,
)
from identify.results.effect import EffectOnJoint
from identify.results.improvement import ImprovementDocument, Step
from identify.results.unseen_motion import EffectOnMotion, JointUnseenMotion, UnseenMotionErrors


def candidate(effect="stribeck", rank=1, **changes):
    fields = {
        "relative_error_before": 0.08,
        "relative_error_after": 0.05,
        "heldout_error_before": 0.0812,
        "heldout_error_after": 0.0567,
        "p_value": 1.2e-9,
        "justified": True,
        "indistinguishable_from": (),
        "caution": None,
        "explanation": "Friction falls with speed.",
        "equation": "x",
        "variable": "dq",
        "constants": {},
        **changes,
    }
    return Candidate(effect=effect, rank=rank, **fields)


def where(**changes):
    fields = {
        "from_": -0.1,
        "to": 0.25,
        "share_of_error": 0.614,
        "share_of_samples": 0.2,
        "excess": 0.4,
        **changes,
    }
    return Where(**{"variable": "dq", **fields})


LEARNED = Learned(
    effect="learned-position-j3",
    variables=("q", "direction"),
    form="c max(0, q - 0.7)",
    knots=((0.0, 0.5),),
    values=(1.0, 2.0, 3.0, 4.0),
    deviations=(0.25, None, 0.5, 0.75),
    unit="N m",
    relative_error_before=0.08,
    relative_error_after=0.04,
    p_value=1e-12,
    explanation="",
    file="",
)


def joint(**changes):
    fields = {
        "verdict": "missing",
        "missing": ("stribeck",),
        "candidates": (candidate(), candidate("offset", 2, p_value=None, heldout_error_after=None)),
        "evidence": (),
        "where": (),
        "noise_floor": 0.02,
        "structure": (),
        "superfluous": (),
        **changes,
    }
    return JointDiagnosis(joint="j3", **fields)


def document(*joints, **changes):
    fields = {"relative_error": 0.0733, "relative_error_with_missing": 0.05, "noise_floor": None, **changes}
    return DiagnosisDocument(experiment="arm", model="usual", joints=joints, not_applicable=(), **fields)


def lines(text):
    return [" ".join(line.split()) for line in text.splitlines()]


def motion(*joints):
    return UnseenMotionErrors(horizon=1.0, unseen="validation", windows=5, joints=joints)


BETTER = JointUnseenMotion(joint="j3", position_rms=0.002, position_rms_before=0.004, unit="rad", worse=False)
WORSE = JointUnseenMotion(joint="j4", position_rms=0.005, position_rms_before=None, unit="m", worse=True)


def test_errors_are_percentages_and_what_is_not_known_is_said():
    shown = lines(diagnosis_text(document(joint())))
    assert shown[0] == "arm, model usual: relative error 7.33 % (noise floor unknown)"
    assert "+ stribeck 8.12 % 5.67 % 1.2e-09" in shown
    assert "offset 8.12 % unknown unknown" in shown
    assert "Friction falls with speed." in shown


@pytest.mark.parametrize(
    ("verdict", "missing", "said"),
    [
        ("missing", ("stribeck", "offset"), "j3: the model misses stribeck, then offset"),
        ("adequate", (), "j3: the model is adequate: what is left is noise"),
        ("unexplained", (), "j3: the model misses something that is in no catalogue"),
    ],
)
def test_the_verdict_is_a_sentence(verdict, missing, said):
    assert said in lines(diagnosis_text(document(joint(verdict=verdict, missing=missing))))


def test_only_the_best_candidates_are_listed_with_what_cannot_be_told_from_them():
    many = tuple(
        candidate(f"effect-{rank}", rank, indistinguishable_from=("a", "b") * (rank == 2))
        for rank in range(1, 10)
    )
    text = diagnosis_text(document(joint(verdict="adequate", missing=(), candidates=many)))
    assert [f"effect-{rank} " in text for rank in range(1, 10)] == [True] * SHOWN + [False] * (9 - SHOWN)
    assert text.count("cannot be distinguished from a, b") == 1


def test_the_two_most_striking_places_of_the_error_are_named():
    places = (
        where(),
        where(variable="session", label="session-02.csv"),
        where(share_of_error=0.01),
    )
    shown = lines(diagnosis_text(document(joint(where=places, superfluous=("offset", "viscous")))))
    assert "61% of the squared error lies at dq -0.1 to 0.25" in shown
    assert "61% of the squared error lies at session session-02.csv" in shown
    blow = where(variable="time", from_=17.02, to=17.43, label="session-01.csv")
    struck = lines(diagnosis_text(document(joint(where=(blow,)))))
    assert "61% of the squared error lies at time 17.02 to 17.43 s of session-01.csv" in struck
    assert not any(line.startswith("1%") for line in shown)
    assert "terms that do not help: offset, viscous" in shown


def test_what_the_rest_can_be_predicted_from_is_told_of_the_strongest_that_was_found():
    def left(*variables, found=True):
        return LeftoverStructure(variables=variables, share=0.86, deviation=0.01, found=found)

    told = "86% of the power that is left can be predicted from dq and dq of y"
    shown = (joint(structure=(left("q", found=False), left("dq", "dq of y"), left("load"))), joint())
    assert lines(diagnosis_text(document(*shown))).count(told) == 1
    assert "can be predicted" not in diagnosis_text(document(joint(structure=(left("moments"),))))


def test_a_description_is_offered_with_its_table_in_both_directions_and_how_to_try_it():
    shown = lines(diagnosis_text(document(joint(learned=LEARNED))))
    at = shown.index(
        "offered, not added: learned-position-j3, a description and no cause: held out 8.00 %, with it 4.00 %"
    )
    assert shown[at + 1 : at + 6] == [
        "c max(0, q - 0.7) (N m)",
        "q backwards N m forwards N m",
        "0 1 ± 0.25 2",
        "0.5 3 ± 0.5 4 ± 0.75",
        "to try it: --keep-learned, then --add learned-position-j3@j3",
    ]
    plain = LEARNED.model_copy(update={"variables": ("q",), "form": None})
    shown = lines(diagnosis_text(document(joint(learned=plain))))
    at = shown.index("q N m")
    assert shown[at + 1 : at + 3] == ["0 1 ± 0.25", "0.5 2"]


def test_what_helps_the_torque_and_hurts_the_motion_is_named():
    effect = EffectOnMotion(effect="stribeck", joint="j3", motion=motion(BETTER, WORSE))
    assert lines(diagnosis_text(document(joint(), motion=(effect,))))[-1] == (
        "with stribeck@j3: 1 s ahead on unseen motion: j3 0.004 → 0.002 rad, j4 0.005 m;"
        " it helps the torque and hurts the motion of j4"
    )


def test_an_improvement_is_a_list_of_steps_from_the_start():
    added = EffectOnJoint(effect="stribeck", joint="j3")
    steps = (
        Step(added=None, relative_error=0.08, relative_error_validation=None),
        Step(added=added, relative_error=0.05, relative_error_validation=0.06, motion=motion(BETTER)),
    )
    made = ImprovementDocument(
        experiment="arm", model="usual", steps=steps, verdict="adequate", learned={"j4": LEARNED}
    )
    shown = lines(improvement_text(made))
    assert shown[:4] == [
        "arm, from the usual model:",
        "0. start 8.00 %",
        "1. + stribeck (j3) 5.00 %, on the validation sessions 6.00 %",
        "1 s ahead on unseen motion: j3 0.004 → 0.002 rad",
    ]
    assert shown[4] == "j4:"
    assert shown[-1] == "Verdict: adequate."
