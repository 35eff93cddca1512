"""`coulomb run`, `export`, `recover` and `demo`, as processes."""

import json
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from pyarrow import parquet
from scipy.io import loadmat

from api.service.model_story import ModelStory
from identify.recording import load_experiment

ROOT = Path(__file__).parents[2]
RIG = "rx130l-joint3-simulated"


def coulomb(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "api", *map(str, arguments)],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """An experiment with one session made by `coulomb run`, and what the command said."""
    folder = tmp_path_factory.mktemp("run") / "experiment"
    done = coulomb(
        "run", RIG, "--payload", "disk-7", "--seconds", 20, "--experiment", folder, "--yes", "--json"
    )
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout)


def test_run_records_a_session_and_identifies_over_all_so_far(recorded):
    folder, said = recorded
    assert said["state"] == "done"
    assert said["file"] == str(folder / "session-00.h5")
    assert said["identification"]["sessions"][0]["payload"] == "disk-7"
    story = ModelStory(folder)
    assert [(version.id, version.model) for version in story.read().versions] == [("m1", "usual")]
    assert json.loads((story.fit_folder("m1") / "identification.json").read_text()) == said["identification"]
    assert [entry.payload.name for entry in load_experiment(folder).sessions] == ["disk-7"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["no-such-rig", "--payload", "none"], "no-such-rig"),
        ([RIG, "--payload", "anvil"], "payload 'anvil' is not known"),
        ([RIG, "--payload", "none", "--plan", "no-plan.json"], "no-plan.json"),
        ([RIG, "--payload", "none", "--seconds", "6"], "seconds"),
    ],
)
def test_run_refuses_wrong_arguments_in_one_line_and_writes_nothing(tmp_path, arguments, words):
    done = coulomb("run", *arguments, "--experiment", tmp_path / "e", "--yes")
    assert done.returncode == 2
    assert words in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "e").exists()


def test_run_asks_before_a_robot_moves(tmp_path):
    done = coulomb(
        "run", RIG, "--payload", "none", "--mass", 0, "--seconds", 20, "--experiment", tmp_path / "e"
    )
    assert done.returncode == 1
    assert "Start? The robot will move" in done.stderr
    assert list((tmp_path / "e").glob("**/session-*")) == []


def test_a_session_is_exported_as_csv_mat_and_parquet_with_the_same_numbers(recorded, tmp_path):
    folder, _ = recorded
    recording = folder / "session-00.h5"
    with h5py.File(recording) as file:
        position = file["position"]
        q = position[:, 0] * position.attrs["matrix"][0, 0] + position.attrs["offset"][0]
        v = file["command"][:, 0] * file["command"].attrs["scale"][0]
        t = (file["sync_time"][:] - file["sync_time"][0]) * 1e-9
    for ending in ("csv", "mat", "parquet"):
        assert coulomb("export", recording, tmp_path / f"x.{ending}").returncode == 0
    table = np.genfromtxt(tmp_path / "x.csv", delimiter=",", names=True)
    matlab = loadmat(tmp_path / "x.mat")
    columns = parquet.read_table(tmp_path / "x.parquet")
    for name, expected in (("q1", q), ("v1", v), ("t", t)):
        np.testing.assert_array_equal(table[name], expected)
        np.testing.assert_array_equal(matlab[name.rstrip("1")][:, 0], expected)
        np.testing.assert_array_equal(columns[name].to_numpy(), expected)
    assert b"disk-7" in columns.schema.metadata[b"payload"]


def test_an_export_is_refused_when_its_name_or_its_source_is_wrong(recorded, tmp_path):
    folder, _ = recorded
    recording = folder / "session-00.h5"
    (tmp_path / "there.csv").write_text("")
    wrong = tmp_path / "wrong.h5"
    wrong.write_text("no recording")
    for source, target, words in (
        (recording, tmp_path / "x.xls", "must end in"),
        (recording, tmp_path / "there.csv", "already exists"),
        (recording, tmp_path / "nowhere" / "x.csv", "there is no folder"),
        (wrong, tmp_path / "x.csv", "cannot be read as a recording"),
    ):
        done = coulomb("export", source, target)
        assert done.returncode == 2
        assert words in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["there.csv", "wrong.h5"]


def test_recover_says_that_there_is_nothing_to_recover(recorded):
    folder, _ = recorded
    done = coulomb("recover", folder, "--json")
    assert json.loads(done.stdout)["sessions"] == []
    assert "nothing to recover" in done.stderr


@pytest.mark.slow
def test_the_demo_records_three_payload_sessions_and_the_error_falls(tmp_path):
    done = coulomb("demo", "--out", tmp_path, "--json")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert [session["mass"] for session in said["sessions"]] == [0.0, 3.4584, 6.970]
    assert [len(result["sessions"]) for result in said["identifications"]] == [1, 2, 3]
    steps = [step["relative_error"] for step in said["improvement"]["steps"]]
    assert len(steps) > 1
    assert steps[-1] < 0.6 * steps[0]
    assert said["load_velocity"]["relative_error"] < 0.6 * said["identifications"][-1]["relative_error"]
    for session in said["sessions"]:
        with h5py.File(Path(said["experiment"]) / session["file"]) as file:
            seconds_of_motion = np.count_nonzero(np.diff(file["setpoint"][:, 0])) * file.attrs["cycle"]
            assert seconds_of_motion > 60.0
