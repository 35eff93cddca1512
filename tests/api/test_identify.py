"""`coulomb identify` on input that is wrong: exit status 2, one line, nothing written."""

import gzip
import subprocess
import sys

import pytest

from tests.identify.recording.conftest import EXPERIMENT, session_text

SAMPLES = session_text(400)

MISTAKES = {
    "misspelt key": (EXPERIMENT.replace("gravity", "gravitiy"), SAMPLES, "line 4: robot.gravitiy"),
    "payload not declared": (
        EXPERIMENT.replace("payload: none", "payload: disk"),
        SAMPLES,
        "sessions[0].payload",
    ),
    "missing file": (EXPERIMENT.replace("session-00", "session-01"), SAMPLES, "session-01.csv"),
    "not a number": (EXPERIMENT, SAMPLES.replace("0.007,", "0.007,nan,", 1), "line 9"),
    "time backwards": (EXPERIMENT, SAMPLES.replace("\n0.007,", "\n0.005,", 1), "line 9: column 't'"),
    "cut short": (EXPERIMENT, gzip.compress(SAMPLES.encode())[:200], "cut short"),
    "empty": (EXPERIMENT, "", "is empty"),
    "at rest": (
        EXPERIMENT,
        "t,q1,v1\n" + "".join(f"{k / 1000},0.5,1\n" for k in range(400)),
        "no joint moves",
    ),
    "no torque": (
        EXPERIMENT,
        "t,q1,v1\n" + "".join(f"{k / 1000},{1e-6 * k * k},0\n" for k in range(400)),
        "column 'v1' is zero throughout",
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_identify_refuses_in_one_line_and_writes_nothing(tmp_path, name):
    experiment, samples, said = MISTAKES[name]
    (tmp_path / "experiment.yaml").write_text(experiment)
    (tmp_path / "session-00.csv").write_bytes(samples if isinstance(samples, bytes) else samples.encode())
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    command = [sys.executable, "-m", "api", "identify", str(tmp_path), "--json"]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert said in done.stderr
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


ARGUMENTS = {
    "no such option": (["--modell", "usual"], "No such option: --modell"),
    "an option without its value": (["--model"], "requires an argument"),
    "one argument too many": (["more"], "unexpected extra argument"),
    "no such model": (["--model", "usal"], "did you mean 'usual'?"),
    "no such effect": (["--add", "stribek"], "did you mean 'stribeck'?"),
    "no such joint": (["--add", "stribeck@j2"], "joints are j1"),
    "no such payload": (["--payload", "disk"], "payloads are none"),
    "no such estimator": (["--estimator", "least"], "estimators are"),
}


@pytest.mark.parametrize("name", ARGUMENTS)
def test_wrong_arguments_are_said_in_one_line(tmp_path, name):
    arguments, said = ARGUMENTS[name]
    (tmp_path / "experiment.yaml").write_text(EXPERIMENT)
    (tmp_path / "session-00.csv").write_text(SAMPLES)
    command = [sys.executable, "-m", "api", "identify", str(tmp_path), "--json", *arguments]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert said in done.stderr
