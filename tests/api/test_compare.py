"""`coulomb compare` and `coulomb identify` as an operator runs them, on a small experiment on disk."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest
import yaml

from identify.recording.session_csv import write_csv_session
from tests.identify.estimation import simulated_arm


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("experiment")
    random = np.random.default_rng(1)
    joint = {"name": "j3", "type": "revolute", "drive_gain": simulated_arm.GAIN}
    document = {
        "format": 1,
        "name": "arm",
        "robot": {"gravity": [0.0, -9.81, 0.0], "joints": [joint]},
        "payloads": [
            {"name": "none", "mass": 0.0},
            {"name": "disk", "mass": 3.5, "com": [1.277, 0.0, 0.0]},
        ],
        "sessions": [
            {"file": "a.csv", "payload": "none"},
            {"file": "b.csv", "payload": "disk"},
            {"file": "c.csv", "payload": "disk", "role": "validation"},
        ],
    }
    for session in document["sessions"]:
        mass = 3.5 if session["payload"] == "disk" else 0.0
        raw = simulated_arm.record(
            simulated_arm.Motion(), simulated_arm.Arm(), random, rate=250.0, torque_noise=2.0, payload=mass
        )
        write_csv_session(folder / session["file"], raw.time, raw.position, raw.command)
    (folder / "experiment.yaml").write_text(yaml.safe_dump(document))
    return folder


def coulomb(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "api", *map(str, arguments)], capture_output=True, text=True, check=False
    )


def test_compare_draws_every_session_of_every_model_and_says_their_errors(folder, tmp_path):
    done = coulomb(
        "compare", folder, "--model", "rigid", "--model", "usual", "--out", tmp_path / "out", "--json"
    )
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    rigid, usual = document["models"]
    assert (rigid["model"], usual["model"]) == ("rigid", "usual")
    assert usual["relative_error"] < 0.1 * rigid["relative_error"]
    assert usual["relative_error_validation"] < 0.1 * rigid["relative_error_validation"]
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    courses = [f"course-{m}-{s}.{kind}" for m in ("rigid", "usual") for s in "abc" for kind in ("png", "svg")]
    assert names == sorted([*courses, "where.png", "where.svg"])
    for path in (tmp_path / "out").iterdir():
        start = path.read_bytes()[:100]
        assert start.startswith(b"\x89PNG\r\n" if path.suffix == ".png" else b"<?xml")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]  # no scratch folder is left


def test_a_model_that_does_not_exist_leaves_nothing_behind(folder, tmp_path):
    done = coulomb("compare", folder, "--model", "best", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.strip().splitlines()) == 1
    assert "best" in done.stderr
    assert not list(tmp_path.iterdir())


def test_added_effects_stand_beside_the_model_without_them(folder, tmp_path):
    done = coulomb("compare", folder, "--model", "usual", "--add", "viscous-asymmetric", "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "usual + viscous-asymmetric" in done.stdout


def test_identify_prints_tables_for_a_reader(folder):
    done = coulomb("identify", folder)
    assert done.returncode == 0, done.stderr
    for text in (
        "model usual",
        "Relative error",
        "validation",
        "ZZ1R",
        "kg m^2",
        "ZZ1 + Ia1",
        "By speed",
        "Signals",
    ):
        assert text in done.stdout
    assert "{" not in done.stdout


def test_identify_fits_the_sessions_with_a_payload_only_and_checks_the_others(folder):
    done = coulomb("identify", folder, "--payload", "none", "--json")
    assert done.returncode == 0, done.stderr
    roles = [own["role"] for own in json.loads(done.stdout)["sessions"]]
    assert roles == ["identification", "left out", "validation"]


def test_the_catalogue_is_printed_with_its_explanations(folder):
    done = coulomb("effects")
    assert done.returncode == 0
    assert "load-friction-asymmetric" in done.stdout
    assert "Check:" in done.stdout


@pytest.mark.parametrize(
    "arguments",
    [("--estimator", "best"), ("--payload", "brick"), ("--model", "usual+stribeck"), ("--add", "magic")],
)
def test_wrong_arguments_are_refused_in_one_line_that_names_them(folder, arguments):
    done = coulomb("identify", folder, *arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.strip().splitlines()) == 1
    assert arguments[1].partition("+")[0] in done.stderr
