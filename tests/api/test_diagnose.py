"""`coulomb diagnose --keep-learned`: what is offered is told, and written beside the experiment."""

import pytest
from typer.testing import CliRunner

from api.command_line import _register_commands, application
from tests.plants.single_joint import record, write_experiment


@pytest.fixture
def bumper(tmp_path):
    """A joint that leans on a rubber bumper at one end of its travel."""
    made = record(
        {"one-sided-bumper": 0.1}, payload_masses=(0.0, 3.0), duration=30.0, rate=250.0, repeats=1, seed=4
    )
    return write_experiment(tmp_path / "joint", made)


def test_an_offered_description_is_told_and_written_where_it_can_be_added(bumper):
    _register_commands("diagnose")
    done = CliRunner().invoke(application, ["diagnose", str(bumper), "--keep-learned"])
    assert done.exit_code == 0, done.output
    assert "offered, not added: learned-position-elbow, a description and no cause" in done.output
    assert "--add learned-position-elbow@elbow" in done.output
    assert "learned-position-elbow.yaml" in (bumper / "experiment.yaml").read_text()
    assert (bumper / "learned-position-elbow.yaml").read_text().startswith("name: learned-position-elbow\n")
