"""What is foretold of a candidate, and the next experiment from a diagnosis that was kept."""

import numpy as np
import pytest

import identify
from identify.diagnosis.diagnosis import diagnose_record
from identify.diagnosis.next_experiment import separate, separate_diagnosed
from identify.diagnosis.with_candidate import predictions_with, shown_findings
from identify.estimation.requested_model import open_record, requested_model
from identify.results.diagnosis import DiagnosisDocument
from identify.results.reading import document_from_json
from tests.plants.rx130l_joint3 import Rx130lJoint3, write_experiment


@pytest.fixture(scope="module")
def looked(tmp_path_factory):
    """One session without payload: the record, its usual model and what is missing in it."""
    folder = tmp_path_factory.mktemp("foretold")
    write_experiment(folder, Rx130lJoint3(), seed=5, duration=12.0, rate=250.0, payload_masses=(0.0,))
    record = open_record(identify.load_experiment(folder))
    model = requested_model(record, "usual", [])
    return folder, record, model, diagnose_record(record, "usual", model)


def test_what_is_foretold_of_a_candidate_is_what_adding_it_gives(looked):
    folder, _, _, diagnosis = looked
    experiment = identify.load_experiment(folder)
    finding = diagnosis.joints[0].findings[0]
    foretold = predictions_with(diagnosis, finding, experiment.sessions)[0]
    added = identify.identify(experiment, model="usual", add=[finding.candidate.name])
    fitted = added.prediction(experiment.sessions[0].file, foretold.joint)
    plain = identify.identify(experiment, model="usual")
    before = plain.prediction(experiment.sessions[0].file, foretold.joint)
    assert np.array_equal(foretold.time, fitted.time)
    # The fit searches the constants once more, on its own load.
    assert foretold.relative_error == pytest.approx(fitted.relative_error, rel=0.05)
    assert foretold.relative_error < 0.8 * before.relative_error


def test_the_best_candidates_and_all_that_is_missing_are_worth_a_look(looked):
    diagnosis = looked[3]
    names = [finding.candidate.name for finding in shown_findings(diagnosis, 0, 2)]
    assert names[:2] == [finding.candidate.name for finding in diagnosis.joints[0].findings[:2]]
    assert {term.effect.name for term in diagnosis.joints[0].missing} <= set(names)


def test_a_diagnosis_that_was_kept_asks_for_the_same_experiment(looked):
    _, record, model, diagnosis = looked
    said = document_from_json(DiagnosisDocument, diagnosis.document().json_text(), "stored")
    direct = separate(record, diagnosis)
    kept = separate_diagnosed(record, model, said, "j3")
    assert kept is not None
    assert kept.rivals == direct.rivals
    assert kept.posture == direct.posture
    for one, other in zip(kept.proposals, direct.proposals, strict=True):
        assert (one.payload, one.shape, one.repeats) == (other.payload, other.shape, other.repeats)
        # Both start from the constants of the search; only those of what is missing beside were refined since.
        assert one.separation == pytest.approx(other.separation, rel=0.1)


def test_two_effects_that_are_both_missing_are_no_rivals(looked):
    joint = looked[3].document().joints[0]
    for candidate in joint.candidates:
        if candidate.effect in joint.missing:
            assert not set(candidate.indistinguishable_from) & set(joint.missing)


def test_where_no_rivals_are_left_no_experiment_is_asked_for(looked):
    _, record, model, diagnosis = looked
    joint = diagnosis.joints[0].document()
    candidates = tuple(each.changed(indistinguishable_from=()) for each in joint.candidates)
    said = diagnosis.document().changed(joints=(joint.changed(candidates=candidates),))
    assert separate_diagnosed(record, model, said, "j3") is None
