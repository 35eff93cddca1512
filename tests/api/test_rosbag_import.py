"""`coulomb import BAG`: joint states in recordings of ROS, read without ROS."""

import json

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from api.commands import diagnose, import_
from identify.recording import InputError, load_experiment
from identify.recording.foreign import read_foreign
from tests.api.recordings_of_ros import joint_state, trajectory_state, write_bag, write_bag_of_ros1

application = typer.Typer()
application.callback()(lambda: None)
import_.register(application)

TIME = np.arange(400) / 200
POSITION = np.stack([np.sin(3 * TIME), np.cos(2 * TIME)], axis=1)
EFFORT = np.stack([2 * np.cos(3 * TIME), np.sin(TIME)], axis=1)
NAMES = ("shoulder", "elbow")

ARM = """<robot name="arm"><link name="base"/>
<link name="l1"><inertial><mass value="2"/></inertial></link><link name="l2"><inertial><mass value="1"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="9" velocity="9"/></joint>
<joint name="elbow" type="revolute"><origin xyz="0.3 0 0"/><parent link="l1"/><child link="l2"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="9" velocity="9"/></joint></robot>"""


def run(*arguments):
    """The command in this process; its result, or the error that becomes exit status 2."""
    return CliRunner().invoke(application, ["import", *map(str, arguments)])


def messages(swap=False, effort=True, count=None):
    """Joint states of the motion above; with `swap` the joints stand in another order in every second message."""
    for k, time in enumerate(TIME[:count]):
        order = [1, 0] if swap and k % 2 else [0, 1]
        names = [NAMES[joint] for joint in order]
        yield time, joint_state(time, names, POSITION[k, order], EFFORT[k, order] if effort else [])


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    return tmp_path / "arm.urdf"


@pytest.mark.parametrize("compressed", [False, True])
def test_a_recording_of_ros_1_becomes_the_same_session(tmp_path, arm, compressed):
    bag = write_bag_of_ros1(tmp_path / "run.bag", "/joint_states", messages(swap=True), compressed=compressed)
    done = run(bag, "--out", tmp_path / "made", "--robot", arm)
    assert done.exit_code == 0, (done.exception, done.output)
    experiment = load_experiment(tmp_path / "made")
    assert [joint.name for joint in experiment.robot.joints] == list(NAMES)
    session = experiment.read(experiment.sessions[0])
    np.testing.assert_allclose(session.time, TIME, atol=1e-8)
    np.testing.assert_array_equal(session.position, POSITION)
    np.testing.assert_array_equal(session.command, EFFORT)
    bag.write_bytes(bag.read_bytes()[:-2000])
    damaged = run(bag, "--out", tmp_path / "none", "--robot", arm)
    assert isinstance(damaged.exception, InputError)
    assert "run.bag: cannot be read as a recording of ROS" in str(damaged.exception)
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
@pytest.mark.parametrize("single_file", [False, True])
def test_joint_states_become_a_session_of_the_urdfs_joints(tmp_path, arm, storage, single_file):
    bag = write_bag(tmp_path / "bag", storage, {"/joint_states": messages(swap=True)})
    source = next(path for path in bag.iterdir() if path.suffix in (".mcap", ".db3")) if single_file else bag
    done = run(source, "--out", tmp_path / "made", "--robot", arm, "--json")
    assert done.exit_code == 0, (done.exception, done.output)
    (said,) = json.loads(done.stdout)["sessions"]
    assert any("topic /joint_states" in words for words in said["decided"])
    experiment = load_experiment(tmp_path / "made")
    assert [joint.name for joint in experiment.robot.joints] == list(NAMES)
    session = experiment.read(experiment.sessions[0])
    np.testing.assert_allclose(session.time, TIME, atol=1e-9)
    np.testing.assert_array_equal(session.position, POSITION)
    np.testing.assert_array_equal(session.command, EFFORT)


def test_the_states_of_a_trajectory_controller_are_read_beside_them(tmp_path):
    states = (
        (time, trajectory_state(time, NAMES, POSITION[k], EFFORT[k])) for k, time in enumerate(TIME[:100])
    )
    bag = write_bag(tmp_path / "bag", "mcap", {"/joint_states": messages(), "/arm/controller_state": states})
    table = read_foreign(bag)
    name = "/arm/controller_state:elbow.effort"
    np.testing.assert_array_equal(table.column(name, "a test").numbers, EFFORT[:100, 1])
    assert len(table.column("elbow.effort", "a test")) == 400
    assert table.joints == NAMES


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: {"/joint_states": messages(effort=False)}, "holds no effort of joint 'shoulder'"),
        (dict, "holds no joint states"),
    ],
)
def test_what_a_recording_lacks_is_named_and_nothing_is_left(tmp_path, arm, make, said):
    bag = write_bag(tmp_path / "bag", "mcap", make())
    done = run(bag, "--out", tmp_path / "made", "--robot", arm)
    assert isinstance(done.exception, InputError)
    assert said in str(done.exception)
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize("cut", [30, 300, 3000])
def test_a_damaged_file_is_refused_in_one_line(tmp_path, arm, cut):
    bag = write_bag(tmp_path / "bag", "mcap", {"/joint_states": messages()})
    file = next(bag.glob("*.mcap"))
    (tmp_path / "cut.mcap").write_bytes(file.read_bytes()[:cut])
    done = run(tmp_path / "cut.mcap", "--out", tmp_path / "made", "--robot", arm)
    assert isinstance(done.exception, InputError)
    assert "\n" not in str(done.exception)


ONE_JOINT = """<robot name="one"><link name="base"/><link name="l1"><inertial><mass value="2"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="9" velocity="9"/></joint></robot>"""


def test_a_recording_is_diagnosed_in_one_line(tmp_path):
    diagnosing = typer.Typer()
    diagnose.register(diagnosing)
    time = np.arange(8000) / 500
    position = np.sin(1.3 * time) + 0.4 * np.sin(3.1 * time)
    velocity = 1.3 * np.cos(1.3 * time) + 1.24 * np.cos(3.1 * time)
    acceleration = -1.69 * np.sin(1.3 * time) - 3.844 * np.sin(3.1 * time)
    effort = 2 * acceleration + 5 * np.cos(position) + 3 * velocity + 4 * np.sign(velocity)
    effort += np.random.default_rng(3).normal(0, 0.05, len(time))
    states = (
        (t, joint_state(t, ["shoulder"], [q], [tau]))
        for t, q, tau in zip(time, position, effort, strict=True)
    )
    bag = write_bag(tmp_path / "bag", "mcap", {"/joint_states": states})
    (tmp_path / "one.urdf").write_text(ONE_JOINT)
    record = next(bag.glob("*.mcap"))
    done = CliRunner().invoke(
        diagnosing, ["diagnose", str(record), "--robot", str(tmp_path / "one.urdf"), "--json"]
    )
    assert done.exit_code == 0, (done.exception, done.output)
    said = json.loads(done.stdout)
    assert said["relative_error"] < 0.05
    assert [joint["joint"] for joint in said["joints"]] == ["shoulder"]
    refusal = CliRunner().invoke(diagnosing, ["diagnose", str(record)])
    assert "name its robot by --robot" in str(refusal.exception)


def two_topics(tmp_path):
    """The robot's states, and longer ones of a simulation with joints of the same names."""
    return write_bag(
        tmp_path / "bag",
        "mcap",
        {"/robot/joint_states": messages(count=300), "/sim/joint_states": messages()},
    )


def test_joints_on_several_topics_are_refused_until_one_is_named(tmp_path, arm):
    bag = two_topics(tmp_path)
    done = run(bag, "--out", tmp_path / "made", "--robot", arm)
    assert isinstance(done.exception, InputError)
    said = str(done.exception)
    assert "/sim/joint_states (400 messages), /robot/joint_states (300 messages); say which: --topic" in said
    assert not (tmp_path / "made").exists()
    done = run(bag, "--out", tmp_path / "made", "--robot", arm, "--topic", "/robot/joint_states")
    assert done.exit_code == 0, (done.exception, done.output)
    experiment = load_experiment(tmp_path / "made")
    assert len(experiment.read(experiment.sessions[0]).time) == 300
    wrong = run(bag, "--out", tmp_path / "none", "--robot", arm, "--topic", "/joint_states")
    assert "holds no joint states on '/joint_states'; it holds them on /" in str(wrong.exception)
    (tmp_path / "log.csv").write_text("t,q,i\n0,1,2\n1,2,3\n")
    wrong = run(tmp_path / "log.csv", "--out", tmp_path / "none", "--topic", "/joint_states")
    assert "is no recording of ROS" in str(wrong.exception)


def test_a_topic_without_efforts_is_no_rival(tmp_path, arm):
    topics = {"/joint_states": messages(count=300), "/desired": messages(effort=False)}
    done = run(
        write_bag(tmp_path / "bag", "mcap", topics), "--out", tmp_path / "made", "--robot", arm, "--json"
    )
    assert done.exit_code == 0, (done.exception, done.output)
    (said,) = json.loads(done.stdout)["sessions"]
    assert any("topic /joint_states (" in words for words in said["decided"])
