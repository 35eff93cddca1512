"""What is said of a joint when a description stands in the place of an effect."""

from __future__ import annotations

from identify.results.diagnosis import Learned

LEARNED = Learned(
    effect="learned-position-elbow",
    variables=("q",),
    form=None,
    knots=((-1.0, 1.0),),
    values=(0.0, 2.0),
    deviations=(0.0, 0.1),
    unit="N m",
    relative_error_before=0.02,
    relative_error_after=0.01,
    p_value=1e-9,
    explanation="A torque over the position.",
    file="name: learned-position-elbow\ncolumns: [q]\n",
)


def test_a_replaced_effect_is_named_no_more_and_what_it_was_probable_for_is_in_no_catalogue(diagnosed):
    joint = diagnosed(("joint-spring", 1.0)).joints[0]
    plain, described = joint.document(), joint.described(LEARNED, {"joint-spring"}).document()
    assert plain.missing == ("joint-spring",)
    assert (described.verdict, described.missing, described.evidence) == ("unexplained", (), ())
    assert described.learned == LEARNED
    assert described.candidate("joint-spring").probability == 0.0
    assert described.probability_unexplained == plain.candidate("joint-spring").probability > 0.5
