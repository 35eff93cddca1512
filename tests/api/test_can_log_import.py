"""`coulomb import LOG --rig RIG`: what was logged by anything gives the parameters that our own recording gives."""

import gzip
import json

import can
import h5py
import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import identify
from api.commands import import_
from daq.can_log import read_can_log
from daq.excitation.standard_plan import standard_plan
from daq.rig import Rig
from daq.session_events import SessionState
from daq.session_workflow import PayloadSession
from identify.recording import InputError, load_experiment
from tests.api.recordings_of_ros import joint_state, write_bag

RIG = "rx130l-joint3-simulated"
application = typer.Typer()
application.callback()(lambda: None)
import_.register(application)


def run(*arguments):
    """The command in this process; its result, or the error that becomes exit status 2."""
    return CliRunner().invoke(application, ["import", *map(str, arguments)])


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """An experiment with one recorded session, its raw log, and when the recording begins and ends in that log (s)."""
    folder = tmp_path_factory.mktemp("recorded") / "experiment"
    rig = Rig.load(RIG)
    with PayloadSession(rig, folder, standard_plan(rig, 20.0), rig.payload("disk-7"), "operator") as session:
        assert session.check().ok
        session.confirm_payload(rig.payload("disk-7").mass)
        session.arm()
        session.start()
        assert session.wait(120) is SessionState.DONE, session.reason
    with h5py.File(folder / "session-00.h5") as file:
        first, last = (file["sync_time"][[0, -1]] * 1e-9).tolist()
    log = folder.parent / "unpacked.log"
    log.write_bytes(gzip.decompress((folder / "session-00.log.gz").read_bytes()))
    with can.CanutilsLogReader(log) as reader:
        begin = next(each.timestamp for each in reader if each.arbitration_id == 0x80)
    return folder, log, first - begin, last - begin


@pytest.fixture(scope="module")
def own(recorded):
    """The parameters by the recording."""
    return parameters(load_experiment(recorded[0]))


def parameters(experiment):
    """Values of all parameters of the usual model, by name."""
    return {
        each["name"]: each["value"] for each in plain(identify.identify(experiment, "usual"))["parameters"]
    }


def plain(result):
    """An identification as plain JSON."""
    document = result.to_json()
    return document if isinstance(document, dict) else json.loads(document.model_dump_json())


def rewritten(log, target):
    """The same frames in another format of log, written by python-can; our own raw log as it is."""
    if target.suffix == ".log":
        target.write_bytes(log.read_bytes())
        return
    if target.suffix == ".gz":
        target.write_bytes((log.parent / "experiment" / "session-00.log.gz").read_bytes())
        return
    with can.Logger(target) as logger, can.CanutilsLogReader(log) as reader:
        for message in reader:
            message.channel = 1
            logger.on_message_received(message)


@pytest.mark.parametrize("ending", [".log", ".log.gz", ".asc", ".blf", ".trc"])
def test_a_log_gives_the_parameters_of_the_recording(tmp_path, recorded, own, ending):
    _, log, begin, end = recorded
    rewritten(log, tmp_path / f"bus{ending}")
    options = [
        "--rig",
        RIG,
        "--payload",
        "disk-7",
        "--begin",
        f"{begin:.9f}",
        "--end",
        f"{end:.9f}",
        "--json",
    ]
    done = run(tmp_path / f"bus{ending}", "--out", tmp_path / "made", *options)
    assert done.exit_code == 0, (done.exception, done.output)
    (said,) = json.loads(done.stdout)["sessions"]
    assert "as given" in said["decided"][-1]
    found = parameters(load_experiment(tmp_path / "made"))
    assert found.keys() == own.keys()
    for name, value in own.items():
        assert found[name] == pytest.approx(value, rel=1e-9), name


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
def test_a_bag_of_the_same_session_gives_the_parameters_of_the_recording(tmp_path, recorded, own, storage):
    experiment = load_experiment(recorded[0])
    session = experiment.read(experiment.sessions[0])
    (joint,) = experiment.robot.joints
    rows = zip(session.time, session.position, session.command, strict=True)
    states = ((time, joint_state(time, ["j3"], position, command)) for time, position, command in rows)
    bag = write_bag(tmp_path / "bag", storage, {"/joint_states": states})
    payload = experiment.sessions[0].payload
    options = ["--type", "revolute", "--joint", "j3", "--gain", repr(joint.drive_gain), "--gravity"]
    options += [
        ",".join(map(repr, experiment.robot.gravity)),
        "--dh",
        f"{joint.alpha},{joint.d},{joint.theta},{joint.r}",
    ]
    options += ["--payload", payload.name, "--payload-mass", repr(payload.mass)]
    options += ["--payload-com", ",".join(map(repr, payload.com))]
    done = run(bag, "--out", tmp_path / "made", *options)
    assert done.exit_code == 0, (done.exception, done.output)
    found = parameters(load_experiment(tmp_path / "made"))
    assert found.keys() == own.keys()
    for name, value in own.items():
        assert found[name] == pytest.approx(value, rel=1e-9), name


def test_without_a_time_what_was_driven_is_taken_and_a_second_log_is_appended(tmp_path, recorded):
    _, log, begin, end = recorded
    options = ["--out", tmp_path / "made", "--rig", RIG, "--payload", "disk-7"]
    first = run(log, *options)
    assert first.exit_code == 0, (first.exception, first.output)
    assert "in which all drives were enabled" in first.output
    assert run(log, *options, "--append", "--role", "validation").exit_code == 0
    experiment = load_experiment(tmp_path / "made")
    assert [(entry.file, entry.role) for entry in experiment.sessions] == [
        ("session-00.h5", "identification"),
        ("session-01.h5", "validation"),
    ]
    read = experiment.read(experiment.sessions[0])
    assert np.ptp(read.time) >= end - begin


def test_the_sync_of_another_bus_in_the_log_is_no_sample(tmp_path, recorded):
    _, log, begin, _ = recorded
    lines = [line.replace("rx130l-joint3", "can1") for line in log.read_text().splitlines()]
    both = [each for line in lines for each in (line, f"{line.split()[0]} can0 080#")]
    (tmp_path / "both.log").write_text("\n".join(both))
    (tmp_path / "one.log").write_text("\n".join(lines))
    one, two = (
        read_can_log(tmp_path / f"{name}.log", Rig.load(RIG), begin, begin + 1) for name in ("one", "both")
    )
    for name in ("sync_time", "position", "command", "valid"):
        np.testing.assert_array_equal(two.rows[name], one.rows[name])
    assert "of its channels can1, which has most of the drives' process data" in two.remarks
    late = read_can_log(tmp_path / "one.log", Rig.load(RIG), begin, begin + 1000)
    assert "it ends before" in late.remarks[-1]


def test_a_frame_that_was_cut_with_the_file_is_no_sample_and_said(tmp_path, recorded):
    _, log, begin, _ = recorded
    text = log.read_text()
    cut = text[: text.index(" 183#", len(text) // 2) + len(" 183#") + 6]
    (tmp_path / "cut.log").write_text(cut)
    found = read_can_log(tmp_path / "cut.log", Rig.load(RIG), begin, begin + 1000)
    assert "1 frame has less data than the PDO: cut off, or mapped otherwise; left out" in found.remarks
    whole = read_can_log(log, Rig.load(RIG), begin, begin + 1000)
    np.testing.assert_array_equal(found.rows["position"][:-1], whole.rows["position"][: len(found.rows) - 1])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text.replace(" 080#", " 081#"), "holds no SYNC"),
        (lambda text: text.replace(" 183#", " 184#"), "holds no frame 0x183 of node 3"),
        (lambda text: text[: len(text) // 2].replace("#", "!"), "cannot be read as a .log log"),
        (lambda text: text.replace("3712", "3102"), "name a part by --begin and --end"),
        (lambda text: "", "is empty"),
    ],
)
def test_a_log_that_lacks_something_is_refused_and_nothing_is_left(tmp_path, recorded, change, said):
    lines = recorded[1].read_text().splitlines(keepends=True)[:400]
    (tmp_path / "bus.log").write_text(change("".join(lines)))
    done = run(tmp_path / "bus.log", "--out", tmp_path / "made", "--rig", RIG)
    assert isinstance(done.exception, InputError)
    assert said in str(done.exception)
    assert [path.name for path in tmp_path.iterdir()] == ["bus.log"]
