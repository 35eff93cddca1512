"""What no catalogue knows is offered as a description, and only there; it is then an effect like any other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import identify
from identify.diagnosis.description import Describer, _Tried
from identify.diagnosis.diagnosis import diagnose_record
from identify.diagnosis.improvement import improve
from identify.estimation.observation import observe
from identify.estimation.requested_model import open_record, requested_model
from identify.recording import InputError, append_effect
from tests.plants.single_joint import record, write_experiment


def hidden(folder, effects, **motion):
    settings = {"payload_masses": (0.0, 3.0), "duration": 30.0, "rate": 250.0, "repeats": 1, **motion}
    return write_experiment(folder / "joint", record(effects, **settings))


@pytest.fixture(scope="module")
def bumper(tmp_path_factory):
    """A joint that leans on a rubber bumper at one end: 16 max(0, q − 0.7)^1.5."""
    return hidden(tmp_path_factory.mktemp("bumper"), {"one-sided-bumper": 0.1}, seed=4)


@pytest.fixture(scope="module")
def said(bumper):
    return identify.diagnose(identify.load_experiment(bumper)).document()


def test_a_bumper_on_one_side_is_described_as_what_it_is_and_not_called_a_spring(said):
    joint = said.joints[0]
    assert (joint.verdict, joint.missing) == ("unexplained", ())
    assert joint.learned.variables == ("q",)
    assert "max(0, q - " in joint.learned.form
    assert joint.learned.relative_error_after < 0.7 * joint.learned.relative_error_before
    knots, values = np.array(joint.learned.knots[0]), np.array(joint.learned.values)
    truth = 16.0 * np.maximum(0.0, knots - 0.7) ** 1.5
    np.testing.assert_allclose(values, truth, atol=0.15 * truth.max())
    assert all(deviation >= 0 for deviation in joint.learned.deviations)


def test_what_is_kept_is_added_like_any_effect_and_leaves_nothing_to_explain(bumper, said):
    learned = said.joints[0].learned
    kept = append_effect(bumper, learned.effect, learned.file)
    loaded = identify.load_experiment(bumper)
    assert loaded.effects == (kept,)
    added = [f"{learned.effect}@elbow"]
    before, after = (identify.identify(loaded, "usual", add).document() for add in ([], added))
    assert after.relative_error < 0.8 * before.relative_error
    again = identify.diagnose(loaded, "usual", added).document().joints[0]
    assert (again.verdict, again.learned) == ("adequate", None)
    # without it, it is what the diagnosis misses: now it stands in a catalogue
    assert identify.diagnose(loaded).document().joints[0].missing == (learned.effect,)
    with pytest.raises(InputError, match="exists already"):
        append_effect(bumper, learned.effect, learned.file)


def test_improvement_offers_and_does_not_add(tmp_path):
    folder = hidden(tmp_path, {"drifting-offset": 1.0}, seed=5)
    story = improve(identify.load_experiment(folder)).document()
    assert story.verdict == "unexplained"
    learned = story.learned["elbow"]
    assert learned.variables == ("time",)
    assert learned.effect not in {str(step.added) for step in story.steps}
    # 4 (1 − exp(−t/9)): the constant part is the offset's
    change = np.ptp(np.array(learned.values))
    assert change == pytest.approx(4.0 * (1 - np.exp(-30.0 / 9.0)), rel=0.1)


@pytest.mark.parametrize(
    "effects", [{}, {"joint-spring": 1.0}, {"viscous-quadratic": 0.5}, {"sloshing": 0.3}]
)
def test_nothing_is_offered_where_nothing_is_missing_or_its_name_is_known_or_no_function_of_one_variable(
    tmp_path, effects
):
    joint = (
        identify.diagnose(identify.load_experiment(hidden(tmp_path, effects, seed=6))).document().joints[0]
    )
    assert joint.learned is None
    assert joint.verdict == {0: "adequate"}.get(
        len(effects), "unexplained" if "sloshing" in effects else "missing"
    )


@pytest.mark.parametrize("payloads", [(0.0, 3.0), (0.0,)])
def test_the_payload_ratio_is_the_models_last_column_and_no_column_of_its_base(tmp_path, payloads):
    """A description is judged beside the model's base with the ratio apart: what each sees must not overlap."""
    folder = hidden(tmp_path, {}, seed=6, duration=8.0, payload_masses=payloads)
    fitted = identify.identify(identify.load_experiment(folder), "usual").fitted
    observation = observe(fitted.record, fitted.entries, fitted.slots, fitted.torque)
    tried = _Tried(fitted, observation, {}, ())
    base, terms = tried.base(frozenset()), {slot.term.key for slot in fitted.slots}
    names = [slot.term.effect.name for slot in fitted.slots]
    estimated = "payload-mass" in names
    assert estimated == (len(payloads) > 1)
    np.testing.assert_array_equal(
        tried.ratio, observation.slot_columns[names.index("payload-mass")] if estimated else []
    )
    np.testing.assert_array_equal(
        np.sort(np.concatenate([base, tried.ratio])), np.arange(len(fitted.fit.chi))
    )
    (dropped,) = [key for key in terms if key[0] == "viscous"]
    without = tried.base(frozenset({dropped}))
    np.testing.assert_array_equal(np.setdiff1d(base, without), tried.columns_of(frozenset({dropped})))


@pytest.mark.parametrize(
    ("effect", "strength", "seed"), [("viscous-asymmetric", 0.1, 1), ("viscous-quadratic", 0.15, 2)]
)
def test_a_form_that_explains_nothing_beside_a_known_effect_does_not_take_its_place(
    tmp_path, effect, strength, seed
):
    """A form with an edge and a power bends to what the right effect is; in doubt the known one is the cause."""
    folder = hidden(tmp_path, {effect: strength}, duration=20.0, seed=seed)
    opened = open_record(identify.load_experiment(folder), "usual")
    diagnosis = diagnose_record(opened, "usual", requested_model(opened, "usual", ()))
    joint = diagnosis.joints[0]
    assert [term.effect.name for term in joint.missing] == [effect]
    describer = Describer.of(diagnosis.better, diagnosis.fitted)
    assert describer.offer(0, replace(joint, doubted="dq")) is None
