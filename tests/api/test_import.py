"""`coulomb import`: somebody's file becomes an experiment, or one line says what is missing."""

import os
import pty
import subprocess
import sys

import h5py
import numpy as np
import pytest
import typer
from scipy.io import savemat
from typer.testing import CliRunner

from api.commands import import_
from identify.recording import InputError, load_experiment

application = typer.Typer()
application.callback()(lambda: None)
import_.register(application)


def run(*arguments):
    """The command as a user runs it, without a terminal."""
    command = [sys.executable, "-m", "api", "import", *map(str, arguments)]
    return subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)


def refused(*arguments):
    """The one line that says why the command refuses (it becomes exit status 2); in this process, to be
    quick."""
    ran = CliRunner().invoke(application, ["import", *map(str, arguments)])
    assert isinstance(ran.exception, InputError), ran.output
    assert "\n" not in str(ran.exception)
    return str(ran.exception)


def drive(rows=500):
    """A slide as its makers store it: time, position, voltage, reference, and the gain as a number."""
    time = np.arange(rows) / 1000
    return {
        "t": time,
        "qm": 0.1 * np.sin(3 * time),
        "vir": np.cos(3 * time),
        "qg": 0.1 * np.sin(3 * time),
        "gtau": 35.15,
    }


SLIDE = ["--time", "t", "--position", "qm", "--command", "vir", "--command-unit", "V", "--gain", "gtau"]
SLIDE += ["--type", "prismatic", "--gravity", "0,-9.81,0", "--keep", "qg"]


def written_mat(path, variables):
    savemat(path, {name: np.reshape(value, (-1, 1)) for name, value in variables.items()})


def written_mat_73(path, variables):
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            file[name] = np.reshape(value, (1, -1))
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


@pytest.mark.parametrize("write", [written_mat, written_mat_73])
def test_a_mat_file_becomes_an_experiment(tmp_path, write):
    variables = drive()
    write(tmp_path / "data.mat", variables)
    done = run(tmp_path / "data.mat", "--out", tmp_path / "slide", *SLIDE)
    assert done.returncode == 0, done.stderr
    assert "500 samples of 1 joint at 1000 Hz" in done.stdout
    experiment = load_experiment(tmp_path / "slide")
    assert experiment.name == "slide"
    assert experiment.drive_gain.tolist() == [[35.15]]
    assert experiment.robot.joints[0].type == "prismatic"
    session = experiment.read(experiment.sessions[0])
    np.testing.assert_array_equal(session.time, variables["t"])
    np.testing.assert_array_equal(session.position[:, 0], variables["qm"])
    np.testing.assert_array_equal(session.command[:, 0], variables["vir"])
    np.testing.assert_array_equal(session.extra["qg"], variables["qg"])


def test_a_csv_of_another_dialect_is_converted_to_si(tmp_path):
    rows = [f"{k};{90 * np.sin(k / 100):.6f};{250 * k};{k};{k};on".replace(".", ",") for k in range(300)]
    (tmp_path / "log.csv").write_text("\n".join(["Zeit;A1;I1;A2;I2;state", *rows]))
    done = run(
        *(
            tmp_path / "log.csv",
            "--out",
            tmp_path / "arm",
            "--name",
            "two axes",
            "--time",
            "Zeit",
            "--time-unit",
            "ms",
        ),
        *(
            "--position",
            "q2=A2",
            "--position",
            "q1=A1",
            "--position-unit",
            "deg",
            "--command",
            "I1",
            "--command",
            "I2",
        ),
        *(
            "--command-unit",
            "mA",
            "--command-unit",
            "0.5",
            "--gain",
            "2",
            "--gain",
            "-3",
            "--type",
            "revolute",
        ),
        *("--dh", "0,0,0,0", "--dh", "1.5707963267948966,0.2,0,0.1", "--joint", "base", "--joint", "elbow"),
        *("--gravity", "0,0,-9.81", "--payload", "disk", "--payload-mass", "2.5", "--payload-com", "0.1,0,0"),
    )
    assert done.returncode == 0, done.stderr
    experiment = load_experiment(tmp_path / "arm")
    assert experiment.name == "two axes"
    assert [joint.name for joint in experiment.robot.joints] == ["base", "elbow"]
    assert experiment.robot.joints[1].alpha == pytest.approx(np.pi / 2)
    assert experiment.payloads[0].com == (0.1, 0.0, 0.0)
    session = experiment.read(experiment.sessions[0])
    np.testing.assert_allclose(session.time, np.arange(300) / 1000)
    np.testing.assert_allclose(session.position[:, 0], np.pi / 2 * np.sin(np.arange(300) / 100), atol=1e-7)
    np.testing.assert_allclose(session.position[:, 1], np.deg2rad(np.arange(300)))
    np.testing.assert_allclose(
        session.command, np.stack([0.25 * np.arange(300), 0.5 * np.arange(300)], axis=1)
    )


def test_a_second_file_is_appended_as_a_session(tmp_path):
    written_mat(tmp_path / "data.mat", drive())
    assert run(tmp_path / "data.mat", "--out", tmp_path / "slide", *SLIDE).returncode == 0
    more = [
        "--time",
        "t",
        "--position",
        "qm",
        "--position-unit",
        "m",
        "--command",
        "vir",
        "--role",
        "validation",
    ]
    done = run(tmp_path / "data.mat", "--out", tmp_path / "slide", "--append", *more)
    assert done.returncode == 0, done.stderr
    entries = load_experiment(tmp_path / "slide").sessions
    assert [(entry.file, entry.role) for entry in entries] == [
        ("session-00.csv", "identification"),
        ("session-01.csv", "validation"),
    ]


def without(option):
    index = SLIDE.index(option)
    return [*SLIDE[:index], *SLIDE[index + 2 :]]


def changed(option, value):
    index = SLIDE.index(option)
    return [*SLIDE[: index + 1], value, *SLIDE[index + 2 :]]


TIME_IN_THE_WRONG_COLUMN = ["--time", "vir", "--position", "qm", "--command", "qg", *SLIDE[6:-2]]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            changed("--time", "vir"),
            "column 'vir' (column 3) is given as the time and as the command of joint 1",
        ),
        (without("--time"), "--time or --rate is missing"),
        (without("--position"), "--position is missing"),
        (without("--command"), "--command is missing"),
        (without("--gain"), "--gain is missing"),
        (without("--type"), "--type is missing"),
        (without("--gravity"), "--gravity is missing"),
        (changed("--position", "qx"), "no column 'qx' for the position of joint 1; there are t, qm, vir, qg"),
        (TIME_IN_THE_WRONG_COLUMN, "column 'vir', sample 2: time does not increase"),
        (changed("--gain", "big"), "--gain: 'big' is not a number"),
        (changed("--gain", "0"), "drive_gain: is 0"),
        (changed("--type", "sliding"), "'revolute' or 'prismatic', not 'sliding'"),
        (changed("--gravity", "9.81"), "--gravity: '9.81' has 1 numbers; 3 are needed"),
        (changed("--command-unit", "pounds"), "--command-unit: 'pounds' is not known"),
        (changed("--keep", "holes"), "column 'holes', sample 4: not a finite number"),
        (changed("--keep", "short"), "column 'short' has 20 samples, the first position 500"),
        (
            [*SLIDE, "--position", "qg", "--dh", "0,0,0,0", "--dh", "0,0,0,0"],
            "2 position and 1 command columns",
        ),
        ([*SLIDE, "--position-unit", "furlong"], "--position-unit: 'furlong' is not known"),
        ([*SLIDE, "--role", "test"], "role"),
    ],
)
def test_a_mistake_is_named_and_nothing_is_written(tmp_path, options, said):
    variables = drive()
    written_mat(tmp_path / "data.mat", variables)
    if "holes" in options or "short" in options:
        holes = np.where(np.arange(500) == 3, np.nan, 0.0)
        written_mat(tmp_path / "data.mat", variables | {"holes": holes, "short": np.zeros(20)})
    assert said in refused(tmp_path / "data.mat", "--out", tmp_path / "slide", *options)
    assert [path.name for path in tmp_path.iterdir()] == ["data.mat"]


def test_a_refusal_is_one_line_and_exit_status_two(tmp_path):
    written_mat(tmp_path / "data.mat", drive())
    done = run(tmp_path / "data.mat", "--out", tmp_path / "slide", *without("--gain"))
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.splitlines() == [
        "coulomb: --gain is missing: joint torque for one unit of command, for each joint"
    ]


@pytest.mark.parametrize(
    ("out", "said"), [("data.mat", "is a file; give a folder"), ("data.mat/x", "cannot be written")]
)
def test_a_folder_that_cannot_be_made_is_named(tmp_path, out, said):
    written_mat(tmp_path / "data.mat", drive())
    message = refused(tmp_path / "data.mat", "--out", tmp_path / out, *SLIDE)
    assert message.startswith(f"--out {tmp_path / out}")
    assert said in message


@pytest.mark.parametrize("content", [b"", b"\x00\x01\x02\xff" * 50, b"MATLAB 5.0 MAT-file, cut short"])
def test_a_file_that_is_no_measurement_is_refused(tmp_path, content):
    (tmp_path / "data.mat").write_bytes(content)
    assert "data.mat" in refused(tmp_path / "data.mat", "--out", tmp_path / "slide", *SLIDE)
    assert not (tmp_path / "slide").exists()


def test_at_a_terminal_what_is_missing_is_asked_for(tmp_path):
    written_mat(tmp_path / "data.mat", drive())
    terminal, inside = pty.openpty()
    command = [sys.executable, "-m", "api", "import", str(tmp_path / "data.mat")]
    answers = [str(tmp_path / "slide"), "qm", "vir", "t", "prismatic", "gtau", "0,-9.81,0"]
    with subprocess.Popen(
        command, stdin=inside, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as asked:
        os.close(inside)
        os.write(terminal, "".join(f"{answer}\n" for answer in answers).encode())
        out, err = asked.communicate(timeout=60)
    os.close(terminal)
    assert asked.returncode == 0, err
    assert "holds the columns t, qm, vir, qg" in err
    assert "500 samples" in out
    assert load_experiment(tmp_path / "slide").drive_gain.tolist() == [[35.15]]
