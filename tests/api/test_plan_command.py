"""`coulomb plan` as a user calls it."""

import json
import subprocess
import sys

import numpy as np
import pytest

from daq.excitation import ExcitationPlan, violations
from daq.rig import Rig

RIG = "rx130l-joint3-simulated"


def coulomb(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "api", "plan", *arguments],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plan")
    picture, file = folder / "plan.png", folder / "plan.json"
    done = coulomb(RIG, "--seconds", "40", "--json", "--picture", str(picture), "--output", str(file))
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), picture, file


def test_the_json_holds_the_plan_its_deviations_and_what_it_cannot_show(planned):
    document, _, _ = planned
    assert document["model"] == "load-velocity"
    assert document["condition_number"] > 1.0
    assert {"ZZ1R", "FV1", "alpha_m1", "b_g1"} <= {parameter["name"] for parameter in document["parameters"]}
    assert all(parameter["std"] > 0.0 for parameter in document["parameters"])
    assert {"friction-warmup", "friction-temperature"} == {
        effect for one in document["cannot_tell"] for effect in one["effects"]
    }


def test_the_plan_file_and_the_printed_document_give_the_same_trajectory(planned, tmp_path):
    document, _, file = planned
    printed = tmp_path / "printed.json"
    printed.write_text(json.dumps(document))
    times = np.arange(0.0, 40.0, 0.01)
    one, other = (ExcitationPlan.load(path).setpoints(times).position for path in (file, printed))
    assert np.array_equal(one, other)
    assert violations(ExcitationPlan.load(file), Rig.load(RIG)) == []


def test_the_picture_is_a_png(planned):
    _, picture, _ = planned
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_a_plan_file_that_breaks_a_limit_is_refused_with_joint_time_and_value(planned, tmp_path):
    document, _, _ = planned
    moves = [phase for phase in document["plan"]["phases"] if phase["kind"] == "move"]
    moves[3]["duration"] *= 0.2
    moves[3]["ramp"] *= 0.2
    wild = tmp_path / "wild.json"
    wild.write_text(json.dumps(document["plan"]))
    done = coulomb(RIG, "--check", str(wild))
    assert done.returncode == 2
    assert done.stdout == ""
    assert "joint j3: " in done.stderr
    assert " s is beyond the limit of " in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["no-such-rig"], "rig 'no-such-rig' is not known"),
        ([RIG, "--seconds", "5"], "the shortest plan lasts"),
        ([RIG, "--model", "magic"], "model 'magic': not a model"),
        ([RIG, "--payload", "anvil"], "payload 'anvil' is not known"),
        ([RIG, "--criterion", "best"], "--criterion best"),
        ([RIG, "--noise", "0"], "--noise 0"),
        ([RIG, "--seconds", "40", "--picture", "plan.xyz"], "a picture ends in one of"),
    ],
)
def test_wrong_input_gets_one_line_and_exit_status_2(arguments, words, tmp_path):
    done = coulomb(*arguments)
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""
