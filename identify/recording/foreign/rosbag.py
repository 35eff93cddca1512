"""Joint states in ROS recordings (rosbag2 folders, MCAP and SQLite files, rosbag1), read without ROS.

`sensor_msgs/JointState`, and of `control_msgs` the states of joints and of trajectory controllers. Fields by the message
definitions of ros-controls/control_msgs and ros2/common_interfaces.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.recording.errors import InputError
from identify.recording.foreign.table import ForeignColumn, ForeignTable
from identify.recording.interpolation import interpolate
from identify.recording.units import unit_of

JOINT_STATE = "sensor_msgs/msg/JointState"
DYNAMIC_JOINT_STATE = "control_msgs/msg/DynamicJointState"
TRAJECTORY_STATE = "control_msgs/msg/JointTrajectoryControllerState"
KNOWN = (JOINT_STATE, TRAJECTORY_STATE, DYNAMIC_JOINT_STATE)
"""The likelier first where a recording holds several."""
TIME = "time"
POSITION, EFFORT = "position", "effort"

_CONTROL_MESSAGES = {
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values\n",
    DYNAMIC_JOINT_STATE: "std_msgs/Header header\nstring[] joint_names\nInterfaceValue[] interface_values\n",
    TRAJECTORY_STATE: (
        "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint reference\n"
        "trajectory_msgs/JointTrajectoryPoint feedback\ntrajectory_msgs/JointTrajectoryPoint error\n"
        "trajectory_msgs/JointTrajectoryPoint output\nstring[] multi_dof_joint_names\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_reference\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_feedback\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_error\n"
        "trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_output\nfloat64 speed_scaling_factor\n"
    ),
}
"""Definitions for recordings that do not hold their own; of control_msgs 4 (ROS 2 Humble and later)."""


def is_rosbag(path: Path, start: bytes) -> bool:
    """Whether a path is a recording of ROS: a folder with metadata, or a file by its first bytes."""
    if path.is_dir():
        return (path / "metadata.yaml").is_file()
    return start.startswith((b"\x89MCAP0\r\n", b"#ROSBAG V2", b"SQLite format 3\x00"))


@dataclass
class _Topic:
    """What was said on a topic."""

    name: str
    kind: str
    stamps: list[int] = field(default_factory=list)
    """ns: of the headers"""
    received: list[int] = field(default_factory=list)
    """ns: when each message was recorded"""
    values: list[dict[str, float]] = field(default_factory=list)
    apart: list[str] = field(default_factory=list)
    """Joints that speak in messages of their own."""

    def time(self) -> tuple[NDArray[np.int64], str]:
        """ns, and where they are from: headers, unless these are empty."""
        stamps = np.array(self.stamps, dtype=np.int64)
        if len(stamps) and (stamps > 0).all():
            return stamps, "stamps of the headers"
        return np.array(self.received, dtype=np.int64), "times of recording, as the headers hold none"

    def columns(self, prefix: str) -> list[ForeignColumn]:
        """Time and every value by name, NaN where a message lacks it.

        Joints of which some speak in messages of their own (a gripper's, or every joint's) are put on the stamps of the joint
        that has most messages, within the time that all of them cover but those that hardly speak.
        """
        stamps, source = self.time()
        rows = self._rows_of_joints()
        kept = np.array(max(rows.values(), key=len, default=[]), dtype=np.intp)
        main = frozenset(kept.tolist())
        self.apart = [
            joint for joint, spoken in rows.items() if 2 * len(main.intersection(spoken)) < len(spoken)
        ]
        for joint in self.apart:
            if 2 * len(rows[joint]) >= len(main):
                covered = stamps[rows[joint]]
                kept = kept[(stamps[kept] >= covered.min()) & (stamps[kept] <= covered.max())]
        columns = [ForeignColumn(f"{prefix}{TIME}", stamps[kept], None, None, source, absolute=True)]
        torque = unit_of("Nm")
        for name in dict.fromkeys(key for each in self.values for key in each):
            joint = _joint(name)
            numbers = np.array(
                [self.values[row].get(name, np.nan) for row in (rows[joint] if joint in self.apart else kept)]
            )
            effort = name.endswith(f".{EFFORT}")
            if joint in self.apart:
                numbers = _moved(stamps[rows[joint]], numbers, stamps[kept], cubic=not effort)
            columns.append(
                ForeignColumn(
                    f"{prefix}{name}", numbers, None, torque if effort else None, "ROS" if effort else ""
                )
            )
        return columns

    def _rows_of_joints(self) -> dict[str, list[int]]:
        """The messages that each joint speaks in."""
        rows: dict[str, list[int]] = {}
        for row, values in enumerate(self.values):
            for joint in dict.fromkeys(map(_joint, values)):
                rows.setdefault(joint, []).append(row)
        return rows


def _joint(name: str) -> str:
    return name.rpartition(".")[0]


def _moved(
    old: NDArray[np.int64], values: NDArray[np.float64], new: NDArray[np.int64], *, cubic: bool
) -> NDArray[np.float64]:
    """Values interpolated to other stamps (ns); NaN where these lie outside their own."""
    distinct, first = np.unique(old, return_index=True)
    if len(distinct) < 2:
        return np.full(len(new), np.nan)
    origin = distinct[0]
    at = ((new - origin) * 1e-9).astype(np.float64)
    moved = interpolate(((distinct - origin) * 1e-9).astype(np.float64), values[first][:, None], at, cubic)[
        :, 0
    ]
    return np.where((new < distinct[0]) | (new > distinct[-1]), np.nan, moved)


def read_rosbag(path: Path, wanted_topic: str | None = None) -> ForeignTable:
    """Read the joint states of a recording.

    One topic gives the columns JOINT.position, JOINT.velocity, JOINT.effort and time: the wanted one, else of those that hold
    efforts the one of the likeliest kind with most messages. Those of other topics are called TOPIC:JOINT.position.

    Raises InputError: it cannot be read or holds no joint states, or none of the wanted topic; or the package that reads it is
    not installed.
    """
    try:
        highlevel, typesys = (import_module(f"rosbags.{name}") for name in ("highlevel", "typesys"))
    except ImportError:
        raise InputError(
            f"{path}: recordings of ROS need the package rosbags: pip install 'coulomb[ros]'"
        ) from None
    topics: dict[str, _Topic] = {}
    others: set[str] = set()
    try:
        with highlevel.AnyReader([path], default_typestore=_typestore(typesys)) as reader:
            _add_missing_types(reader.typestore, typesys)
            wanted = [each for each in reader.connections if _kind(each.msgtype) in KNOWN]
            others = {f"{each.topic} ({each.msgtype})" for each in reader.connections}
            for connection, received, raw in reader.messages(wanted) if wanted else ():
                message = reader.deserialize(raw, connection.msgtype)
                topic = topics.setdefault(
                    connection.topic, _Topic(connection.topic, _kind(connection.msgtype))
                )
                header = message.header.stamp
                topic.stamps.append(int(header.sec) * 10**9 + int(header.nanosec))
                topic.received.append(int(received))
                topic.values.append(dict(_values(topic.kind, message)))
    except Exception:  # rosbags, apsw, lz4 and zstandard have errors of their own on damaged files
        raise InputError(
            f"{path}: cannot be read as a recording of ROS: damaged, not ended, or a file of it is missing; copy it again,"
            " or mend it (ros2 bag reindex; mcap recover)"
        ) from None
    ranked = sorted(
        topics.values(),
        key=lambda topic: (
            topic.name != wanted_topic,
            not _driven(topic),
            KNOWN.index(topic.kind),
            -len(topic.stamps),
        ),
    )
    if not ranked:
        there = ", ".join(sorted(others)[:8]) or "nothing"
        raise InputError(f"{path}: holds no joint states ({', '.join(KNOWN)}); its topics are {there}")
    if wanted_topic is not None and ranked[0].name != wanted_topic:
        raise InputError(
            f"--topic: {path} holds no joint states on '{wanted_topic}'; it holds them on {', '.join(map(_in_words, ranked))}"
        )
    columns = [
        column
        for place, topic in enumerate(ranked)
        for column in topic.columns("" if place == 0 else f"{topic.name}:")
    ]
    main = ranked[0]
    joints = tuple(_joints(main))
    remarks = [
        f"topic {main.name} ({main.kind}): {len(main.stamps)} messages of {', '.join(joints)}; {main.time()[1]}"
    ]
    if main.apart:
        remarks.append(
            f"{', '.join(main.apart)}: in messages of their own, interpolated to the stamps of the other joints"
        )
    if len(ranked) > 1:
        remarks.append(
            f"further topics with columns TOPIC:...: {', '.join(topic.name for topic in ranked[1:])}"
        )
    undecided = ""
    rivals = [each for each in ranked[1:] if each.kind == main.kind and _driven(main) & _driven(each)]
    if rivals and wanted_topic is None:
        undecided = (
            f"several topics hold positions and efforts of {', '.join(sorted(_driven(main) & _driven(rivals[0])))}:"
            f" {', '.join(_in_words(each) for each in (main, *rivals))}"
        )
        remarks.append(f"{undecided}; {main.name} is taken unless columns of another are named")
    return ForeignTable(
        path, tuple(columns), {}, tuple(remarks), time=TIME, joints=joints, undecided=undecided
    )


def _driven(topic: _Topic) -> set[str]:
    """Joints of which a topic holds a position and an effort."""
    efforts = {
        name.removesuffix(f".{EFFORT}")
        for each in topic.values
        for name, value in each.items()
        if name.endswith(f".{EFFORT}") and np.isfinite(value)
    }
    return efforts & set(_joints(topic))


def _in_words(topic: _Topic) -> str:
    return f"{topic.name} ({len(topic.stamps)} messages)"


def _joints(topic: _Topic) -> dict[str, None]:
    """Joints whose position a topic holds, in the order of its messages."""
    return {
        name.removesuffix(f".{POSITION}"): None
        for each in topic.values
        for name in each
        if name.endswith(f".{POSITION}")
        and not name.endswith((f".reference.{POSITION}", f".output.{POSITION}"))
    }


def _kind(message_type: str) -> str:
    """A message's type as ROS 2 writes it; rosbag1 leaves out /msg/."""
    package, _, name = message_type.rpartition("/")
    return f"{package.removesuffix('/msg')}/msg/{name}"


def _typestore(typesys: Any) -> Any:
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    _add_missing_types(store, typesys)
    return store


def _add_missing_types(store: Any, typesys: Any) -> None:
    needed = {"trajectory_msgs/msg/JointTrajectoryPoint", "std_msgs/msg/Header"} <= store.fielddefs.keys()
    for name, text in _CONTROL_MESSAGES.items():
        if needed and name not in store.fielddefs:
            store.register(typesys.get_types_from_msg(text, name))


def _values(kind: str, message: Any) -> Iterator[tuple[str, float]]:
    """Values of one message by JOINT.WHAT."""
    if kind == JOINT_STATE:
        for what, values in (
            (POSITION, message.position),
            ("velocity", message.velocity),
            (EFFORT, message.effort),
        ):
            yield from (
                (f"{joint}.{what}", float(value)) for joint, value in zip(message.name, values, strict=False)
            )
    elif kind == DYNAMIC_JOINT_STATE:
        for joint, interfaces in zip(message.joint_names, message.interface_values, strict=False):
            names = zip(interfaces.interface_names, interfaces.values, strict=False)
            yield from ((f"{joint}.{what}", float(value)) for what, value in names)
    else:
        feedback = getattr(message, "feedback", None) or getattr(message, "actual", None)
        reference = getattr(message, "reference", None) or getattr(message, "desired", None)
        for prefix, point in (
            ("", feedback),
            ("reference.", reference),
            ("output.", getattr(message, "output", None)),
        ):
            if point is None:
                continue
            for what, values in (
                (POSITION, point.positions),
                ("velocity", point.velocities),
                (EFFORT, point.effort),
            ):
                named = zip(message.joint_names, values, strict=False)
                yield from ((f"{joint}.{prefix}{what}", float(value)) for joint, value in named)
