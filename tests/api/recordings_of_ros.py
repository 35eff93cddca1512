"""Recordings of ROS for tests, written by rosbags."""

from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer as OldWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
STATE = "control_msgs/msg/JointTrajectoryControllerState"
STORE.register(
    get_types_from_msg(
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint reference\n"
        "trajectory_msgs/JointTrajectoryPoint feedback\n",
        STATE,
    )
)


def _header(time):
    total = 1_700_000_000 * 10**9 + (time if isinstance(time, int) else round(time * 1e9))
    stamp = STORE.types["builtin_interfaces/msg/Time"](sec=total // 10**9, nanosec=total % 10**9)
    return STORE.types["std_msgs/msg/Header"](stamp=stamp, frame_id="")


def joint_state(time, names, position, effort):
    """A sensor_msgs/JointState; time in s, or whole ns."""
    return STORE.types["sensor_msgs/msg/JointState"](
        header=_header(time),
        name=list(names),
        position=np.array(position, dtype=float),
        velocity=np.array([], dtype=float),
        effort=np.array(effort, dtype=float),
    )


def trajectory_state(time, names, position, effort):
    """A control_msgs/JointTrajectoryControllerState with feedback alone."""
    empty = np.array([], dtype=float)
    duration = STORE.types["builtin_interfaces/msg/Duration"](sec=0, nanosec=0)
    point = STORE.types["trajectory_msgs/msg/JointTrajectoryPoint"]
    nothing = point(
        positions=empty, velocities=empty, accelerations=empty, effort=empty, time_from_start=duration
    )
    feedback = point(
        positions=np.array(position, dtype=float),
        velocities=empty,
        accelerations=empty,
        effort=np.array(effort, dtype=float),
        time_from_start=duration,
    )
    return STORE.types[STATE](
        header=_header(time), joint_names=list(names), reference=nothing, feedback=feedback
    )


def write_bag(folder: Path, storage: str, topics) -> Path:
    """A rosbag2 folder; topics: name -> (time in s, message) of each."""
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        if not topics:
            connection = writer.add_connection("/chatter", "std_msgs/msg/String", typestore=STORE)
            text = STORE.types["std_msgs/msg/String"](data="hello")
            writer.write(connection, 0, STORE.serialize_cdr(text, "std_msgs/msg/String"))
        for name, messages in topics.items():
            connection = None
            for time, message in messages:
                kind = message.__msgtype__
                connection = connection or writer.add_connection(name, kind, typestore=STORE)
                stamp = 1_700_000_000 * 10**9 + (time if isinstance(time, int) else round(time * 1e9))
                writer.write(connection, stamp, STORE.serialize_cdr(message, kind))
    return folder


def write_bag_of_ros1(path: Path, topic: str, messages, compressed: bool = False) -> Path:
    """A rosbag1 file of joint states; messages: (time in s, message of ROS 2) of each."""
    store = get_typestore(Stores.ROS1_NOETIC)
    kind = "sensor_msgs/msg/JointState"
    writer = OldWriter(path)
    if compressed:
        writer.set_compression(OldWriter.CompressionFormat.BZ2)
    with writer:
        connection = writer.add_connection(topic, kind, typestore=store)
        for number, (_time, message) in enumerate(messages):
            stamp = message.header.stamp
            header = store.types["std_msgs/msg/Header"](
                seq=number,
                stamp=store.types["builtin_interfaces/msg/Time"](sec=stamp.sec, nanosec=stamp.nanosec),
                frame_id="",
            )
            state = store.types[kind](
                header, message.name, message.position, message.velocity, message.effort
            )
            writer.write(connection, stamp.sec * 10**9 + stamp.nanosec, store.serialize_ros1(state, kind))
    return path
