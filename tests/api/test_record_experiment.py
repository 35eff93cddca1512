"""What a command's EXPERIMENT may be: an experiment, or a record with the URDF of its robot, which is imported for as long."""

import numpy as np
import pytest

from api.record_experiment import opened_experiment
from identify.recording import InputError
from tests.api.recordings_of_ros import joint_state, write_bag
from tests.plants.single_joint import record, write_experiment

ARM = """<robot name="arm"><link name="base"/><link name="l1"><inertial><mass value="2"/></inertial></link>
<link name="l2"><inertial><mass value="1"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="9" velocity="9"/></joint>
<joint name="elbow" type="prismatic"><parent link="l1"/><child link="l2"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="9" velocity="9"/></joint></robot>"""
TIME = np.arange(400) / 200
POSITION = np.stack([np.sin(3 * TIME), 0.2 * np.cos(2 * TIME)], axis=1)
EFFORT = np.stack([2 * np.cos(3 * TIME), np.sin(TIME)], axis=1)


@pytest.fixture
def robot(tmp_path):
    (tmp_path / "arm.urdf").write_text(ARM)
    return tmp_path / "arm.urdf"


@pytest.fixture
def bag(tmp_path):
    """Joint states in the other order than the robot's, and shorter ones of a simulation."""

    def states(count):
        for time, position, effort in zip(TIME[:count], POSITION, EFFORT, strict=False):
            yield time, joint_state(time, ["elbow", "shoulder"], position[::-1], effort[::-1])

    return write_bag(tmp_path / "bag", "mcap", {"/joint_states": states(400), "/sim": states(300)})


@pytest.fixture
def experiment(tmp_path):
    return write_experiment(tmp_path / "joint", record({}, payload_masses=(0.0,), duration=2.0, rate=100.0))


@pytest.mark.parametrize("given", ["folder", "file"])
def test_a_record_is_an_experiment_of_its_robots_joints_for_as_long_as_it_is_needed(bag, robot, given):
    """The folder of a recording of ROS, which has no experiment.yaml, or the file in it."""
    path = bag if given == "folder" else next(bag.glob("*.mcap"))
    with opened_experiment(str(path), robot, topic="/joint_states") as opened:
        assert [(joint.name, joint.type) for joint in opened.robot.joints] == [
            ("shoulder", "revolute"),
            ("elbow", "prismatic"),
        ]
        (session,) = opened.sessions
        assert (session.payload.mass, session.role) == (0.0, "identification")
        samples = opened.read(session)
        np.testing.assert_array_equal(samples.position, POSITION)
        np.testing.assert_array_equal(samples.command, EFFORT)
        folder = opened.folder
        assert folder.is_dir()
    assert not folder.parent.exists()


def test_a_chain_may_end_before_the_robot_does_and_a_topic_is_chosen(bag, robot):
    with opened_experiment(str(bag), robot, tip="l1", topic="/sim") as opened:
        assert [joint.name for joint in opened.robot.joints] == ["shoulder"]
        assert len(opened.read(opened.sessions[0]).time) == 300
    with (
        pytest.raises(InputError, match="say which: --topic"),
        opened_experiment(str(bag), robot),
    ):
        pass


@pytest.mark.parametrize("given", ["folder", "file", "folder of a recording too"])
def test_an_experiment_is_itself_and_has_its_robot(experiment, robot, given):
    path = experiment / "experiment.yaml" if given == "file" else experiment
    if given == "folder of a recording too":
        (experiment / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    with opened_experiment(str(path)) as opened:
        assert opened.folder == experiment
    for more, words in (
        ({"robot": robot}, "--robot: .* is an experiment, which has its robot; leave it out"),
        ({"topic": "/joint_states"}, "--topic: .* is an experiment, not a recording of ROS"),
    ):
        with pytest.raises(InputError, match=words), opened_experiment(str(path), **more):
            pass
    assert experiment.is_dir()


def test_a_record_needs_its_robot_and_columns_of_its_joints(tmp_path, robot):
    table = tmp_path / "log.csv"
    table.write_text("t,q,i\n" + "".join(f"{k / 100},{k % 7},{k % 5}\n" for k in range(50)))
    for given, words in (
        ({}, r"log\.csv: is a record; name its robot by --robot"),
        (
            {"robot": robot},
            r"log\.csv: does not say which column .* coulomb import log\.csv --robot arm\.urdf",
        ),
    ):
        with pytest.raises(InputError, match=words), opened_experiment(str(table), **given):
            pass
