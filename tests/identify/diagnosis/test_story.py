"""When a step of an improvement holds, and that a story with an addition exchanged is told again from there, step by step."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from identify.diagnosis import story
from identify.diagnosis.story import JointErrors, Step


def errors(fit=0.1, validation=0.2, held_out=0.3):
    return JointErrors(fit, validation, held_out, unseen=0.0)


@pytest.mark.parametrize(
    ("changed", "no_worse"),
    [
        ({}, True),
        ({"fit": 0.09}, True),
        ({"fit": 0.11}, False),
        ({"validation": 0.21}, False),
        ({"validation": None}, True),
        ({"held_out": 0.31}, False),
        ({"fit": 0.05, "held_out": 0.31}, False),
    ],
)
def test_a_joint_is_no_worse_where_none_of_its_errors_is_higher(changed, no_worse):
    assert errors(**changed).no_worse_than(errors()) is no_worse
    assert errors().no_worse_than(errors(validation=None))


@pytest.mark.parametrize(("slack", "no_worse"), [(1.0, False), (1.09, False), (1.11, True)])
def test_errors_may_be_higher_by_what_is_allowed_alone(slack, no_worse):
    assert errors(fit=0.11, validation=0.22, held_out=0.33).no_worse_than(errors(), slack) is no_worse


RATIOS = SimpleNamespace(estimates_payload_ratio=True, observation=SimpleNamespace(width=9))
"""of two payloads, which a payload's mass says again, and a drive gain with one parameter less"""


@pytest.mark.parametrize(
    ("width", "after", "of_all", "holds"),
    [
        (9, 0.1, 0.4, True),
        (9, 0.1001, 0.4, False),
        (8, 0.1001, 0.4, True),
        (8, 0.101, 0.4, False),
        (8, 0.1, 0.7, False),
    ],
)
def test_what_takes_the_place_of_the_payload_ratio_lowers_the_errors_of_the_loads_as_declared(
    monkeypatch, width, after, of_all, holds
):
    monkeypatch.setattr(story, "as_declared", lambda _: step(0.6, joints=(errors(0.2, 0.3, 0.4),)))
    named = SimpleNamespace(estimates_payload_ratio=False, observation=SimpleNamespace(width=width))
    before = Step(None, RATIOS, 0.4, None, (errors(),))  # type: ignore[arg-type]
    after_it = Step(term(0), named, of_all, None, (errors(fit=after),))  # type: ignore[arg-type]
    assert after_it.holds_after(before) is holds


def term(joint):
    return SimpleNamespace(joint=joint)


BOTH = (errors(), errors())
WITHOUT_RATIO = SimpleNamespace(estimates_payload_ratio=False)


def step(error, validation=0.5, joints=BOTH, added=None):
    return Step(added, WITHOUT_RATIO, error, validation, joints)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("error", "validation", "lowers"),
    [
        (0.3, 0.4, True),
        (0.4, 0.4, False),
        (0.3, 0.5, False),
        (0.3, 0.6, False),
        (0.5, 0.4, False),
        (0.3, None, True),
    ],
)
def test_a_model_lowers_the_error_in_the_fit_and_where_it_was_checked(error, validation, lowers):
    before = step(0.4)
    assert step(error, validation).lowers(before) is lowers
    assert not step(0.4, None).lowers(before)


def test_an_addition_holds_where_its_own_joint_is_no_worse_whatever_the_others_do():
    before = step(0.4)
    worse = (errors(), errors(fit=0.2))
    assert step(0.3, 0.4, worse, term(0)).holds_after(before)
    assert not step(0.3, 0.4, worse, term(1)).holds_after(before)
    assert not step(0.4, 0.4, added=term(0)).holds_after(before)


class FitOf(tuple[str, ...]):
    """A model's fit is the list of its additions here."""

    estimates_payload_ratio = False


@pytest.fixture
def steps_of_a_story(monkeypatch):
    """The four steps of a story; the error of a model follows from its additions."""
    of_model = {
        ("a",): 0.8,
        ("a", "b"): 0.6,
        ("a", "b", "c"): 0.4,
        ("a", "x"): 0.5,
        ("a", "x", "c"): 0.3,
        ("y",): 0.9,
        ("y", "b"): 0.95,
    }

    def made(added, fitted):
        return Step(added, fitted, 1.0 if added is None else of_model[fitted], None, (errors(),))

    monkeypatch.setattr(story, "widened", lambda fitted, added: FitOf((*fitted, added.name)))
    monkeypatch.setattr(story, "step_of", made)
    listed = [made(None, FitOf())]
    for name in "abc":
        addition = SimpleNamespace(joint=0, name=name)
        listed.append(made(addition, FitOf((*listed[-1].fitted, name))))
    return listed


def test_what_comes_behind_an_exchange_is_added_again_in_its_order(steps_of_a_story):
    retold = story._retold(steps_of_a_story, 2, SimpleNamespace(joint=0, name="x"))
    assert [each.fitted for each in retold] == [(), ("a",), ("a", "x"), ("a", "x", "c")]
    assert retold[:2] == steps_of_a_story[:2]


def test_a_story_that_does_not_hold_at_every_step_with_the_exchange_is_none(steps_of_a_story):
    assert story._retold(steps_of_a_story, 1, SimpleNamespace(joint=0, name="y")) is None
