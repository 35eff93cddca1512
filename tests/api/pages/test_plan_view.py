"""A plan as it is seen before anything moves: what of it is drawn, what it can and cannot identify, and what it breaks."""

import re
from types import SimpleNamespace

import pytest

from api.pages.plan_view import findings, plan_view, purpose_words
from api.plan_model import usual_model
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.standard_plan import standard_plan
from daq.excitation.trapezoid import Move
from tests.api.driven_arm import short_plan


@pytest.fixture(scope="module")
def standard(rig):
    return standard_plan(rig, 60.0)


def found_in(plan, rig):
    payload = rig.payload("none")
    return findings(plan, rig, payload, (), usual_model(rig, payload, None))


def by_what(plan, rig):
    return {each.what: (each.kind, each.words) for each in found_in(plan, rig)}


def test_a_standard_plan_determines_the_usual_model_and_repeats(rig, standard):
    found = by_what(standard, rig)
    kind, words = found["The usual model"]
    assert (kind, words.startswith("All 6 parameters are determined; condition number ")) == ("good", True)
    kind, words = found["Noise floor"]
    assert (kind, words.endswith("exact repeats: what no model can explain is measured.")) == ("good", True)
    unseen = [each for each in found_in(standard, rig) if each.what == "Cannot be seen"]
    assert {each.kind for each in unseen} == {"warn"}
    assert any(each.words.startswith("A payload mass that differs") for each in unseen)
    assert not any("j3" in each.words for each in unseen)  # of a rig of one joint


def test_a_short_plan_repeats_nothing_and_says_what_stays_unknown(rig):
    found = by_what(short_plan("short"), rig)
    assert found["Noise floor"] == (
        "warn",
        "No motion repeats exactly: what no model can explain stays unknown.",
    )


@pytest.mark.parametrize(
    ("repeats", "repeated", "kind", "words"),
    [
        (1.9, 0.9, "warn", "No motion repeats"),
        (2.0, 0.199, "warn", "of the plan repeats: too little"),
        (2.0, 0.2, "good", "2 exact repeats"),
        (7.2, 0.8, "good", "7 exact repeats"),
    ],
)
def test_a_noise_floor_needs_two_repeats_and_a_fifth_of_the_plan(
    rig, standard, monkeypatch, repeats, repeated, kind, words
):
    shares = SimpleNamespace(repeats=repeats, repeated=repeated)
    monkeypatch.setattr("api.pages.plan_view.repetition", lambda plan: shares)
    found = by_what(standard, rig)["Noise floor"]
    assert (found[0], words in found[1]) == (kind, True), found


def test_a_joint_at_rest_determines_nothing(rig):
    still = ExcitationPlan(
        name="still", joints=("j3",), start=(1.0,), phases=(Move(to=(1.001,), duration=5.0, ramp=0.5),)
    )
    kind, words = by_what(still, rig)["The usual model"]
    assert kind == "warn"
    assert "cannot be told apart by this motion alone (condition number " in words


def test_one_joint_is_drawn_wide_and_for_a_phone_and_several_share_their_row(rig, standard):
    view = plan_view(standard, rig, rig.payload("none"), [], None)
    (joint,) = view.joints
    assert (joint.name, len(joint.figures), len(joint.narrow)) == ("j3", 2, 2)
    assert (view.duration, view.broken) == (standard.duration, [])
    assert view.torque_words == (
        "The torque cannot be predicted before a first model; the current is watched on every sample."
    )
    assert ">position, rad</text>" in joint.figures[0]
    assert ">speed, rad/s</text>" in joint.figures[1]
    limits = rig.axes[0].limits
    shown = re.findall(r'class="limit-text">([^<]+)<', joint.figures[1])
    assert [float(text.replace("−", "-")) for text in shown] == [limits.velocity, -limits.velocity]
    assert 'viewBox="0 0 420' in joint.narrow[0]
    assert 'viewBox="0 0 420' not in joint.figures[0]


def test_a_plan_beyond_the_limits_is_said_to_break_them(rig):
    fast = ExcitationPlan(
        name="fast", joints=("j3",), start=(0.0,), phases=(Move(to=(1.5,), duration=1.0, ramp=0.4),)
    )
    narrow = rig.model_copy(
        update={
            "axes": tuple(
                axis.model_copy(update={"limits": axis.limits.model_copy(update={"velocity": 0.5})})
                for axis in rig.axes
            )
        }
    )
    assert all(
        "velocity" not in words
        for words in plan_view(standard_plan(rig, 20.0), rig, rig.payload("none"), [], None).broken
    )
    broken = plan_view(fast, narrow, rig.payload("none"), [], None).broken
    assert any("j3" in words and "velocity" in words for words in broken), broken


def test_a_plan_made_to_tell_effects_apart_says_from_what_and_what_the_limits_made_of_it():
    purpose = SimpleNamespace(
        rivals=("stribeck", "own-effect"), joint="j3", payload="disk-7", separation=4.26
    )
    report = SimpleNamespace(purpose=purpose, remarks=("the way was shortened",))
    words = purpose_words(report)
    assert "on joint j3, with the payload disk-7: 4.3 standard deviations are expected." in words
    assert " from own-effect on joint" in words
    assert words.endswith("The way was shortened.")
    assert purpose_words(None) is None
