"""What is said of a joint when a description stands in the place of an effect."""

from __future__ import annotations

from dataclasses import replace

import pytest

from identify.diagnosis.diagnosis import with_descriptions
from identify.diagnosis.structure import Structure
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


@pytest.mark.parametrize(
    ("verdict", "share", "looked_for"),
    [
        ("adequate", 0.2, True),
        ("adequate", 0.05, False),
        ("unexplained", 0.05, True),
        ("missing", 0.2, False),
    ],
)
def test_a_description_is_looked_for_where_structure_is_left_even_if_not_in_every_stretch(
    diagnosed, verdict, share, looked_for
):
    structure = (Structure(("q", "direction"), share, deviation=share),)
    assert replace(diagnosed().joints[0], verdict=verdict, structure=structure).open is looked_for


def test_a_description_that_does_not_hold_is_looked_for_once(diagnosed, monkeypatch):
    looked = []

    class Describer:
        @classmethod
        def of(cls, present, diagnosed):
            return cls()

        def offer(self, place, said):
            looked.append(place)

    monkeypatch.setattr("identify.diagnosis.diagnosis.Describer", Describer)
    plain = diagnosed()
    doubted = replace(plain, joints=(replace(plain.joints[0], verdict="missing", doubted="q"),))
    once = with_descriptions(doubted, of_doubted_only=True)
    assert looked == [0]
    assert once.joints[0].document() == doubted.joints[0].document()
    assert with_descriptions(once) is once
    assert looked == [0]
