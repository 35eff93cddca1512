"""What `coulomb next` prints, of an answer that is given: nothing is computed."""

from __future__ import annotations

import json

import pytest
import typer
from typer.testing import CliRunner

from api.commands import next as next_command
from identify.diagnosis import next_experiment
from identify.results.next_experiment import NextExperimentDocument, Proposal
from tests.plants.single_joint import record, write_experiment

PROPOSAL = Proposal(
    payload="disk",
    shape="trapezoid",
    speed=0.358,
    position_from=-1.2,
    position_to=1.6,
    repeats=2,
    separation=14.23,
    probability=0.973,
    decides=True,
)


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """Runs the command on a record; what the planner of experiments is asked comes with what is printed."""
    folder = write_experiment(tmp_path / "bench", record({}, payload_masses=(0.0,), duration=2.0, rate=100.0))

    def run(proposals, *options):
        given = []

        def answer(experiment, model, add, rivals):
            given.append((experiment.name, model, list(add), list(rivals)))
            return NextExperimentDocument(
                experiment="bench",
                joint="elbow",
                rivals=("load-friction", "stribeck"),
                separation_so_far=1.9,
                proposals=proposals,
                posture=(0.0,),
                advice="Run it.",
            )

        monkeypatch.setattr(next_experiment, "next_experiment", answer)
        application = typer.Typer()
        application.callback()(lambda: None)
        next_command.register(application)
        return CliRunner().invoke(application, ["next", str(folder), *options]), given

    return run


def test_each_proposal_is_a_row_under_its_headings(asked):
    done, given = asked((PROPOSAL,), "--between", "load-friction", "--between", "stribeck")
    assert done.exit_code == 0
    assert given == [("single-joint", "usual", [], ["load-friction", "stribeck"])]
    advice, heading, row = done.output.splitlines()
    assert advice == "Run it."
    assert heading.split() == ["probability", "separation"]
    assert row.split()[:4] == ["0.97", "14.2", "σ", "trapezoid"]
    assert row.endswith("payload disk, up to 0.358/s, from -1.2 to 1.6, 2 repeats")


def test_without_proposals_there_is_the_advice_alone(asked):
    done, _ = asked(())
    assert done.output == "Run it.\n"


def test_the_document_is_printed_as_it_is(asked):
    done, _ = asked((PROPOSAL,), "--json")
    assert json.loads(done.output)["proposals"][0]["probability"] == 0.973


def test_one_effect_is_not_two(asked):
    done, given = asked((PROPOSAL,), "--between", "stribeck")
    assert done.exit_code != 0
    assert "give it twice" in str(done.exception)
    assert not given
