"""Topics of a recording of ROS as columns: whose stamps are taken, what speaks apart, and which kind of message holds what."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from identify.recording.foreign.rosbag import (
    DYNAMIC_JOINT_STATE,
    JOINT_STATE,
    TRAJECTORY_STATE,
    _driven,
    _in_words,
    _joints,
    _kind,
    _moved,
    _Topic,
    _values,
    is_rosbag,
)

SECOND = 10**9


def topic(messages, stamps=None, received=None):
    """A topic on which these values were said, one message every 10 ms."""
    count = len(messages)
    stamps = [SECOND + 10_000_000 * k for k in range(count)] if stamps is None else stamps
    return _Topic("/joint_states", JOINT_STATE, stamps, received or [7] * count, messages)


def state(joint, position, effort=None):
    return {f"{joint}.position": position} | ({} if effort is None else {f"{joint}.effort": effort})


def columns(made, prefix=""):
    return {column.name: column for column in made.columns(prefix)}


def test_time_is_that_of_the_headers_unless_one_of_them_is_empty():
    stamps, source = topic([state("a", 0.0)] * 2, [5, 6], [50, 60]).time()
    assert (stamps.tolist(), source) == ([5, 6], "stamps of the headers")
    stamps, source = topic([state("a", 0.0)] * 2, [0, 6], [50, 60]).time()
    assert (stamps.tolist(), source) == ([50, 60], "times of recording, as the headers hold none")


def test_joints_that_speak_together_stand_side_by_side_and_what_is_missing_is_not_a_number():
    messages = [state("a", k, 10.0 * k) | ({} if k == 2 else state("b", -k)) for k in range(5)]
    found = columns(topic(messages), "/other:")
    assert list(found) == ["/other:time", "/other:a.position", "/other:a.effort", "/other:b.position"]
    assert found["/other:time"].absolute
    assert found["/other:a.effort"].numbers.tolist() == [0, 10, 20, 30, 40]
    assert found["/other:a.effort"].unit.name == "Nm"
    assert found["/other:a.position"].unit is None
    assert np.isnan(found["/other:b.position"].numbers).tolist() == [False, False, True, False, False]


def test_a_joint_in_messages_of_its_own_is_put_on_the_stamps_of_the_one_with_most_within_what_both_cover():
    stamps, messages = [], []
    for k in range(60):
        stamps.append(SECOND + 10_000_000 * k)
        messages.append(state("arm", k**3, k))
        if 10 <= k < 50:  # the gripper speaks 4 ms later
            stamps.append(SECOND + 10_000_000 * k + 4_000_000)
            messages.append(state("gripper", (k + 0.4) ** 3, k + 0.4))
    made = topic(messages, stamps)
    found = columns(made)
    assert made.apart == ["gripper"]
    kept = np.arange(11, 50)
    assert ((found["time"].numbers - SECOND) / 1e7).tolist() == kept.tolist()
    assert found["arm.position"].numbers.tolist() == (kept**3).tolist()
    assert found["gripper.effort"].numbers == pytest.approx(kept)
    inner = slice(2, -2)
    assert found["gripper.position"].numbers[inner] == pytest.approx(kept[inner] ** 3)  # a cubic, exactly


def test_a_joint_that_hardly_speaks_does_not_shorten_the_record():
    messages = [state("arm", k) for k in range(40)] + [state("lamp", 1.0) for _ in range(3)]
    stamps = [SECOND + 10_000_000 * k for k in range(40)] + [
        SECOND + 10_000_000 * k + 1 for k in (20, 21, 22)
    ]
    found = columns(topic(messages, stamps))
    assert len(found["arm.position"].numbers) == 40
    assert np.isfinite(found["lamp.position"].numbers).sum() == 2


def test_outside_its_own_stamps_a_value_is_not_known():
    old, new = np.array([10, 20, 30]) * SECOND, np.array([9, 10, 15, 30, 31]) * SECOND
    moved = _moved(old, np.array([1.0, 2.0, 4.0]), new, cubic=False)
    assert np.isnan(moved).tolist() == [True, False, False, False, True]
    assert moved[1:4] == pytest.approx([1.0, 1.5, 4.0])
    assert np.isnan(_moved(old[:1], np.ones(1), new, cubic=False)).all()
    repeated = _moved(np.array([10, 10, 30]) * SECOND, np.array([1.0, 9.0, 3.0]), new, cubic=False)
    assert repeated[1] == 1.0


def test_joints_are_driven_whose_position_and_effort_are_both_said():
    messages = [
        state("a", 0.0, 1.0)
        | state("b", 0.0)
        | {"c.effort": 1.0, "b.reference.position": 1.0, "d.velocity": 2.0},
        state("b", 0.0, float("nan")),
    ]
    made = topic(messages)
    assert list(_joints(made)) == ["a", "b"]
    assert _driven(made) == {"a"}
    assert _in_words(made) == "/joint_states (2 messages)"


@pytest.mark.parametrize(
    ("written", "kind"),
    [
        ("sensor_msgs/msg/JointState", "sensor_msgs/msg/JointState"),
        ("sensor_msgs/JointState", "sensor_msgs/msg/JointState"),
    ],
)
def test_both_generations_of_ros_name_one_kind(written, kind):
    assert _kind(written) == kind


def test_each_kind_of_message_gives_its_values_by_joint():
    plain = SimpleNamespace(name=["a", "b"], position=[1.0, 2.0], velocity=[], effort=[3.0, 4.0])
    assert dict(_values(JOINT_STATE, plain)) == {
        "a.position": 1.0,
        "b.position": 2.0,
        "a.effort": 3.0,
        "b.effort": 4.0,
    }
    interfaces = SimpleNamespace(interface_names=["position", "temperature"], values=[1.5, 40.0])
    dynamic = SimpleNamespace(joint_names=["a"], interface_values=[interfaces])
    assert dict(_values(DYNAMIC_JOINT_STATE, dynamic)) == {"a.position": 1.5, "a.temperature": 40.0}

    def point(*values):
        return SimpleNamespace(positions=values[:1], velocities=(), effort=values[1:])

    older = SimpleNamespace(joint_names=["a"], actual=point(1.0, 2.0), desired=point(3.0))
    newer = SimpleNamespace(
        joint_names=["a"], feedback=point(1.0, 2.0), reference=point(3.0), output=point(4.0)
    )
    common = {"a.position": 1.0, "a.effort": 2.0, "a.reference.position": 3.0}
    assert dict(_values(TRAJECTORY_STATE, older)) == common
    assert dict(_values(TRAJECTORY_STATE, newer)) == common | {"a.output.position": 4.0}


def test_a_recording_is_told_by_its_folder_or_its_first_bytes(tmp_path):
    assert not is_rosbag(tmp_path, b"")
    (tmp_path / "metadata.yaml").touch()
    assert is_rosbag(tmp_path, b"")
    for start in (b"\x89MCAP0\r\n...", b"#ROSBAG V2.0\n", b"SQLite format 3\x00"):
        assert is_rosbag(Path("log"), start)
    assert not is_rosbag(Path("log"), b"time,q1\n")
