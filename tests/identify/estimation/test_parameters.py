"""What is said of a parameter: percent, unit, and what cannot be given."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identify.effects.catalogue import effects
from identify.effects.model import Term
from identify.estimation.parameters import Parameter, number, slot_names
from tests.identify.effects.summaries import summary_of

FRICTION = Parameter("FV3", "j3", -40.0, 0.5, 1.5, "N m s/rad", None)


def test_the_percentage_is_that_of_eq_16_and_there_is_none_of_nothing():
    assert FRICTION.relative_std_percent == pytest.approx(1.25)
    assert replace(FRICTION, value=0.0).relative_std_percent is None
    assert replace(FRICTION, std=None).relative_std_percent is None
    document = FRICTION.document()
    assert (document.name, document.value, document.std_robust) == ("FV3", -40.0, 1.5)
    assert document.relative_std_percent == pytest.approx(1.25)


@pytest.mark.parametrize(
    ("value", "given"), [(1.5, 1.5), (None, None), (np.nan, None), (np.inf, None), (0, 0.0)]
)
def test_a_figure_that_is_none_is_not_invented(value, given):
    assert number(value) == given


@pytest.mark.parametrize(
    ("revolute", "names"),
    [
        (True, [("FV2", "axis", "N m s/rad")]),
        (False, [("FV2", "axis", "N s/m")]),  # of a slide
    ],
)
def test_names_have_the_joints_number_and_units_those_of_its_kind(revolute, names):
    summaries = [summary_of(), summary_of(joint=1, name="axis", revolute=revolute)]
    record = SimpleNamespace(summaries=summaries, joints=2)
    (listed,) = slot_names(record, Term(effects()["viscous"], 1), {}, 1)  # type: ignore[arg-type]
    assert [listed[:3]] == names
    assert listed[3] is None


@pytest.mark.parametrize(
    ("effect", "names"),
    [("gravity-tilt", ["tilt_1", "tilt_2"]), ("payload-mass", ["mass_ratio[disk]"]), ("coulomb", ["FC1"])],
)
def test_what_belongs_to_the_whole_robot_has_no_joints_number(effect, names):
    record, term = SimpleNamespace(summaries=[summary_of()], joints=1), Term(effects()[effect], 0)
    assert [name for name, *_ in slot_names(record, term, {}, len(names))] == names  # type: ignore[arg-type]
