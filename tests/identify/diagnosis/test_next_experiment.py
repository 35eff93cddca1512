"""The next experiment: what it expects, and whether running it decides."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import identify
from identify.diagnosis.next_experiment import _advice, next_experiment
from identify.diagnosis.separation import Apart, expected_share
from identify.results.next_experiment import NextExperimentDocument, Proposal
from identify.results.reading import document_from_json
from tests.plants.rx130l_joint3 import (
    LEVER,
    STEP,
    Rx130lJoint3,
    SessionRecord,
    _one_way,
    _sinusoid,
    _trapezoids,
    simulate,
    write_experiment,
)

PLANT = Rx130lJoint3()
DISK = 6.97
RATE = 250.0


def run(proposal: Proposal, mass: float, seed: int) -> SessionRecord:
    """The proposed motion on the simulated joint, from rest in the middle of it."""
    distance = proposal.position_to - proposal.position_from
    if proposal.shape == "sinusoid":
        piece = _sinusoid(0.5 * distance, proposal.speed / (np.pi * distance), 1, STEP) + 0.5 * distance
    else:
        piece = _trapezoids(distance, proposal.speed, STEP)
    way = [proposal.position_from + piece] * proposal.repeats
    middle = 0.5 * (proposal.position_from + proposal.position_to)
    approach = middle + _one_way(proposal.position_from - middle, 0.3, STEP)
    reference = np.concatenate([approach, *way])
    return simulate(PLANT, mass, seed=seed, rate=RATE, reference=reference)


def append_session(folder: Path, file: str, payload: str, session: SessionRecord) -> None:
    table = np.column_stack([session.time, session.position, session.command])
    np.savetxt(
        folder / file, table, fmt=("%.6f", "%.10g", "%.6g"), delimiter=",", header="t,q1,v1", comments=""
    )
    text = (folder / "experiment.yaml").read_text()
    (folder / "experiment.yaml").write_text(text + f"  - {{file: {file}, payload: {payload}}}\n")


def declare_payload(folder: Path, name: str, mass: float) -> None:
    """A disk lies ready beside the robot; no session has carried it yet."""
    text = (folder / "experiment.yaml").read_text()
    disk = f"  - {{name: {name}, mass: {mass}, com: [{LEVER}, 0.0, 0.0]}}\nsessions:"
    (folder / "experiment.yaml").write_text(text.replace("sessions:", disk, 1))


def first_joint(folder: Path) -> dict:
    return identify.diagnose(identify.load_experiment(folder)).document().joints[0]


def rivals_of(joint: dict) -> dict[str, list[str]]:
    return {
        candidate.effect: candidate.indistinguishable_from
        for candidate in joint.candidates
        if candidate.effect in joint.missing
    }


SLOW = pytest.mark.slow


@pytest.fixture(scope="module", params=[5, pytest.param(6, marks=SLOW), pytest.param(7, marks=SLOW)])
def bare(request, tmp_path_factory) -> Path:
    """One session without payload, in which the load is only what position and acceleration make of it."""
    folder = tmp_path_factory.mktemp("bare")
    write_experiment(folder, PLANT, seed=request.param, duration=20.0, rate=RATE, payload_masses=(0.0,))
    declare_payload(folder, "disk", DISK)
    return folder


@pytest.fixture(scope="module")
def planned(bare) -> NextExperimentDocument:
    return next_experiment(identify.load_experiment(bare))


def test_the_loop_closes_ambiguous_next_run_decided(bare, planned, tmp_path):
    before = first_joint(bare)
    assert before.missing[0] == "load-friction-asymmetric"
    assert "load-friction" in rivals_of(before)["load-friction-asymmetric"]
    assert set(planned.rivals) == {"load-friction-asymmetric", "load-friction"}

    best = planned.proposals[0]
    assert best.payload == "disk"  # nothing else changes the load
    folder = Path(shutil.copytree(bare, tmp_path / "after"))
    append_session(folder, "next.csv", best.payload, run(best, DISK, seed=90))
    after = first_joint(folder)
    assert "load-friction-asymmetric" in after.missing
    assert rivals_of(after)["load-friction-asymmetric"] == ()


def test_proposals_carry_the_share_that_the_diagnosis_is_expected_to_give(planned):
    """Load friction is its asymmetric rival's special case, for which no motion speaks: of neither is more expected than where
    none contains the other."""
    for proposal in planned.proposals:
        assert (
            planned.probability_so_far - 0.05
            <= proposal.probability
            < expected_share(Apart(proposal.separation))
        )


def test_the_share_so_far_is_the_one_that_the_diagnosis_gives(bare, planned):
    said = first_joint(bare)
    named, rival = (said.candidate(name).probability for name in planned.rivals)
    assert planned.probability_so_far == pytest.approx(named / (named + rival), abs=0.1)


def test_no_proposal_asks_for_more_acceleration_than_the_joint_has_shown(bare, planned):
    record = identify.identify(identify.load_experiment(bare)).fitted.record
    shown = max(np.abs(part.ddq).max() for part in record.samples.values())
    for proposal in planned.proposals:
        half = 0.5 * (proposal.position_to - proposal.position_from)
        if proposal.shape == "sinusoid":
            assert proposal.speed**2 / half <= shown


def test_the_proposal_separates_more_than_the_data_so_far_and_the_best_comes_first(planned):
    separations = [proposal.separation for proposal in planned.proposals]
    assert planned.separation_so_far is not None
    assert separations[0] > 1.5 * planned.separation_so_far
    assert separations == sorted(separations, reverse=True)


def test_what_was_run_tells_them_apart_as_was_expected(bare, planned, tmp_path):
    """In probability: far apart, separations differ, for what both models lack of the new motion is noise to them."""
    best = planned.proposals[0]
    folder = Path(shutil.copytree(bare, tmp_path / "after"))
    append_session(folder, "next.csv", best.payload, run(best, DISK, seed=91))
    after = next_experiment(identify.load_experiment(folder), rivals=planned.rivals)
    assert after.separation_so_far is not None
    assert after.separation_so_far > 5
    assert after.probability_so_far == pytest.approx(best.probability, abs=0.1)


def test_proposals_stay_within_the_motion_that_the_joint_has_shown(bare, planned):
    position = np.loadtxt(bare / "session-00.csv", delimiter=",", skiprows=1)[:, 1]
    for proposal in planned.proposals:
        assert position.min() - 1e-3 <= proposal.position_from < proposal.position_to <= position.max() + 1e-3
        assert 0 < proposal.speed <= 1.1 * 1.2
        assert proposal.repeats >= 1


def test_what_no_motion_separates_is_said_with_what_to_look_at(hidden):
    """All payloads wrong by one factor: as a wrong gain, and only a balance tells."""
    said = next_experiment(identify.load_experiment(hidden(("payload-mass", 1.0))))
    assert set(said.rivals) == {"drive-gain", "payload-mass"}
    assert said.proposals[0].separation < 1.0
    assert "no motion of elbow separates" in said.advice
    assert "payload-mass: " in said.advice


def test_the_document_is_plain_json_with_rivals_separation_and_proposals(planned):
    assert document_from_json(NextExperimentDocument, planned.json_text(), "printed") == planned
    assert planned.proposals[0].decides
    assert planned.advice.startswith("A ")
    assert " rad/s with payload disk, " in planned.advice


@pytest.mark.parametrize(("separation", "run"), [(None, False), (0.95, False), (1.05, True), (14.2, True)])
def test_a_motion_that_parts_the_rivals_by_less_than_the_noise_is_not_advised(separation, run):
    record = SimpleNamespace(joint_names=["j3"], summaries=[SimpleNamespace(revolute=True)])
    terms = [
        SimpleNamespace(effect=SimpleNamespace(name=name, explanation="")) for name in ("drag", "spring")
    ]
    proposal = Proposal(
        payload="disk",
        shape="sinusoid",
        speed=0.3,
        position_from=-1.0,
        position_to=1.0,
        repeats=2,
        separation=separation,
        probability=0.6,
        decides=False,
    )
    words = _advice(record, 0, terms, Apart(0.2), proposal, "")
    assert words.startswith(
        "A sinusoid of j3 between -1 and 1 rad"
        if run
        else "With these payloads and within the limits no motion"
    )
    assert "drag from spring" in words
