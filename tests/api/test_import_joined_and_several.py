"""One session from several files joined on time, several sessions in one call, and sessions appended later."""

import json

import numpy as np
import pytest
import typer
from hypothesis import example, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from api.commands import import_
from identify.recording import InputError, load_experiment

application = typer.Typer()
application.callback()(lambda: None)
import_.register(application)

ROBOT = ["--gain", "1", "--type", "revolute", "--dh", "0,0,0,0", "--gravity", "0,0,-9.81"]


def run(*arguments):
    """The command in this process; its result, or the error that becomes exit status 2."""
    return CliRunner().invoke(application, ["import", *map(str, arguments)])


def position(time):
    return 0.8 * np.sin(2.3 * time)


def current(time):
    return 3.0 * np.cos(1.7 * time)


def table(path, time, clock="t", **columns):
    """A CSV file of a clock and columns."""
    values = np.column_stack([time, *columns.values()])
    header = ",".join([clock, *columns])
    np.savetxt(path, values, delimiter=",", header=header, comments="", fmt="%.12g")
    return path


def as_written(time):
    """The stamps that a reader of the table finds in it."""
    return np.array([float(f"{stamp:.12g}") for stamp in time])


def joined(folder, *files, times=("t",), more=()):
    stated = [word for name in times for word in ("--time", name)]
    roles = ["--position", "q", "--command", "i", "--join"]
    return run(*files, "--out", folder / "made", *stated, *roles, *ROBOT, *more)


@given(rate=st.integers(120, 900), shift=st.floats(-0.9, 0.9), late=st.floats(0, 0.0011))
@example(
    rate=120, shift=0.0, late=2.2e-250
)  # by so little the first sample of the other is before what is common
@settings(max_examples=25, deadline=None)
def test_two_clocks_of_any_rates_are_put_on_the_fastest(tmp_path_factory, rate, shift, late):
    folder = tmp_path_factory.mktemp("join")
    one, other = as_written(np.arange(1200) / 300), as_written(np.arange(4 * rate) / rate + shift + late)
    table(folder / "p.csv", one, q=position(one))
    table(folder / "c.csv", other, i=current(other))
    done = joined(folder, folder / "p.csv", folder / "c.csv")
    assert done.exit_code == 0, (done.exception, done.output)
    experiment = load_experiment(folder / "made")
    session = experiment.read(experiment.sessions[0])
    begin = max(one[0], other[0])
    time = session.time - session.time[0]
    # the first common stamp is one of the faster file's; which of them had more samples in common decides
    starts = [float(stamps[np.searchsorted(stamps, begin)]) for stamps in (one, other)]
    errors = [
        max(
            np.abs(session.position[:, 0] - position(time + start)).max(),
            np.abs(session.command[:, 0] - current(time + start)).max(),
        )
        for start in starts
    ]
    assert min(errors) < 2e-4  # straight lines between currents 8 ms apart


def test_clocks_of_two_kinds_and_files_of_two_days_are_refused(tmp_path):
    time = np.arange(400) / 200
    table(tmp_path / "p.csv", time, q=position(time))
    table(tmp_path / "c.csv", time + 1_764_230_000, i=current(time))
    done = joined(tmp_path, tmp_path / "p.csv", tmp_path / "c.csv")
    assert isinstance(done.exception, InputError)
    assert "c.csv: its time column states dates, that of p.csv seconds; they cannot be joined" in str(
        done.exception
    )
    table(tmp_path / "c.csv", time + 86_400, i=current(time))
    done = joined(tmp_path, tmp_path / "p.csv", tmp_path / "c.csv")
    assert "too little time in common to join them: p.csv 0 to 1.995 s; c.csv 86400 to" in str(done.exception)
    assert not (tmp_path / "made").exists()


def test_a_hole_in_one_file_is_not_interpolated_across(tmp_path):
    time = np.arange(1000) / 500
    hole = (time < 0.8) | (time > 1.1)
    table(tmp_path / "p.csv", time, q=position(time))
    table(tmp_path / "c.csv", time[hole], i=current(time[hole]))
    done = joined(tmp_path, tmp_path / "p.csv", tmp_path / "c.csv", more=["--json"])
    assert done.exit_code == 0, (done.exception, done.output)
    (said,) = json.loads(done.stdout)["sessions"]
    assert any("samples in holes of another file left out" in words for words in said["decided"])
    experiment = load_experiment(tmp_path / "made")
    session = experiment.read(experiment.sessions[0])
    inside = (session.time > 0.81) & (session.time < 1.09)
    assert not inside.any()


def test_each_file_may_name_its_time_differently_and_equal_columns_are_told_apart(tmp_path):
    time = np.arange(600) / 300
    table(tmp_path / "p.csv", time, clock="stamp", q=position(time), status=time)
    table(tmp_path / "c.csv", time, clock="Zeit", i=current(time), status=2 * time)
    done = joined(
        tmp_path, tmp_path / "p.csv", tmp_path / "c.csv", times=("stamp", "Zeit"), more=["--keep", "c:status"]
    )
    assert done.exit_code == 0, (done.exception, done.output)
    experiment = load_experiment(tmp_path / "made")
    session = experiment.read(experiment.sessions[0])
    np.testing.assert_allclose(session.command[:, 0], current(time), atol=1e-9)
    np.testing.assert_allclose(session.extra["c_status"], 2 * time, atol=1e-9)
    three = joined(tmp_path, tmp_path / "p.csv", tmp_path / "c.csv", times=("a", "b", "c"))
    assert isinstance(three.exception, InputError)
    assert "--time" in str(three.exception)


def one_file(path, phase=0.0):
    time = np.arange(500) / 250
    return table(path, time, q=position(time + phase), i=current(time + phase))


ROLES = ["--time", "t", "--position", "q", "--command", "i"]


def test_several_sessions_in_one_call_and_one_appended_without_naming_columns(tmp_path):
    files = [one_file(tmp_path / f"run{k}.csv", k) for k in range(3)]
    done = run(*files, "--out", tmp_path / "made", *ROLES, *ROBOT, "--json")
    assert done.exit_code == 0, (done.exception, done.output)
    said = json.loads(done.stdout)["sessions"]
    assert [(each["file"], each["source"]) for each in said] == [
        (f"session-{k:02d}.csv", str(file)) for k, file in enumerate(files)
    ]
    more = one_file(tmp_path / "later.csv", 7.0)
    done = run(
        more,
        "--append",
        "--out",
        tmp_path / "made",
        "--payload",
        "disk",
        "--payload-mass",
        "2",
        "--role",
        "validation",
    )
    assert done.exit_code == 0, (done.exception, done.output)
    experiment = load_experiment(tmp_path / "made")
    assert [entry.payload.name for entry in experiment.sessions] == ["none", "none", "none", "disk"]
    assert experiment.sessions[-1].role == "validation"
    for entry, phase in zip(experiment.sessions, (0, 1, 2, 7), strict=True):
        session = experiment.read(entry)
        np.testing.assert_allclose(session.position[:, 0], position(np.arange(500) / 250 + phase), atol=1e-11)


def test_one_bad_file_of_three_leaves_the_experiment_as_it_was(tmp_path):
    good = one_file(tmp_path / "good.csv")
    assert run(good, "--out", tmp_path / "made", *ROLES, *ROBOT).exit_code == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "made").iterdir()}
    (tmp_path / "bad.csv").write_text("t,q,i\n" + "\n".join(f"{k},1,x" for k in range(100)))
    again = [one_file(tmp_path / f"again{k}.csv", k) for k in range(2)]
    done = run(again[0], tmp_path / "bad.csv", again[1], "--append", "--out", tmp_path / "made")
    assert isinstance(done.exception, InputError)
    assert "bad.csv" in str(done.exception)
    assert {path.name: path.read_bytes() for path in (tmp_path / "made").iterdir()} == before


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--session", "x.csv"], "--session: one name for 2 sessions"),
        (["--time", "t", "--time", "t"], "--time: 2 given"),
    ],
)
def test_options_for_one_session_are_refused_for_two(tmp_path, more, words):
    files = [one_file(tmp_path / f"run{k}.csv", k) for k in range(2)]
    roles = ROLES[2:] if "--time" in more else ROLES
    done = run(*files, "--out", tmp_path / "made", *roles, *ROBOT, *more)
    assert isinstance(done.exception, InputError)
    assert words in str(done.exception)
    assert not (tmp_path / "made").exists()


def test_another_joined_session_is_appended_without_repeating_anything(tmp_path):
    time = np.arange(300) / 300
    made = tmp_path / "made"
    table(tmp_path / "p.csv", time * 1000, clock="T", q=position(time))
    table(tmp_path / "c.csv", time * 1000, clock="clock", i=current(time))
    done = joined(
        tmp_path,
        tmp_path / "p.csv",
        tmp_path / "c.csv",
        times=("T", "clock"),
        more=("--time-unit", "ms"),
    )
    assert done.exit_code == 0, (done.exception, done.output)
    again = run(tmp_path / "p.csv", tmp_path / "c.csv", "--append", "--out", made)
    assert again.exit_code == 0, (again.exception, again.output)
    experiment = load_experiment(made)
    first, second = (experiment.read(entry) for entry in experiment.sessions)
    np.testing.assert_array_equal(second.position, first.position)
    np.testing.assert_array_equal(second.time, first.time)
    fewer = run(tmp_path / "p.csv", "--append", "--out", made)
    assert "are joined from 2 files each (times: T, clock); give as many, or name --time" in str(
        fewer.exception
    )
    assert len(load_experiment(made).sessions) == 2
