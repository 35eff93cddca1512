"""The experiment's folder as sessions are added to it: what is complete is listed, what is not is kept apart."""

import fcntl
import os
import re
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from daq.raw_log import raw_log_of
from daq.rig import Rig
from identify.recording import (
    DeclaredSession,
    ExperimentFile,
    Joint,
    JointLimits,
    Robot,
    append_session,
    write_experiment,
)
from identify.recording.errors import InputError
from identify.recording.experiment_file import EXPERIMENT_FILE, Payload, read_experiment_file

INCOMPLETE = "incomplete"
"""Folder inside the experiment's for sessions that are being recorded, were aborted, or faulted."""

Role = Literal["identification", "validation"]


def experiment_robot(rig: Rig) -> Robot:
    """The rig's robot as the experiment describes it, drive gains included."""
    gain = rig.drive_gain
    coupled = rig.gear_matrix is not None
    joints = tuple(
        Joint(
            **joint.model_dump(),
            drive_gain=None if coupled else float(gain[index, index]),
            motor_ratio=float(rig.motor_gear[index, index]) if coupled else axis.gear_ratio,
            limits=JointLimits(
                position=axis.limits.position,
                velocity=axis.limits.velocity,
                acceleration=axis.limits.acceleration,
            ),
        )
        for index, (joint, axis) in enumerate(zip(rig.robot.joints, rig.axes, strict=True))
    )
    matrix = tuple(tuple(row) for row in gain.tolist()) if coupled else None
    return Robot(gravity=rig.robot.gravity, joints=joints, drive_gain_matrix=matrix)


def open_experiment(folder: Path, rig: Rig, name: str | None = None) -> bool:
    """Make the experiment's folder and file, or check that those that are there belong to this rig; whether it was made.

    Raises InputError where they belong to another robot.
    """
    path = folder / EXPERIMENT_FILE
    made = not path.exists()
    if not made:
        there = [joint.name for joint in read_experiment_file(path).robot.joints]
        ours = [joint.name for joint in rig.robot.joints]
        if there != ours:
            raise InputError(
                f"{path}: robot.joints are {', '.join(there)}; rig {rig.name} has {', '.join(ours)}: "
                "record into another experiment"
            )
    else:
        experiment = ExperimentFile(
            format=1,
            name=name or folder.resolve().name,
            robot=experiment_robot(rig),
            payloads=rig.payloads,
        )
        write_experiment(folder, experiment)
    (folder / INCOMPLETE).mkdir(exist_ok=True)
    return made


def discard_unused(folder: Path) -> None:
    """Remove an experiment's folder that was made for a session which then recorded nothing; somebody may have been before us."""
    if not (folder / INCOMPLETE).is_dir():
        return
    if {path.name for path in folder.iterdir()} == {EXPERIMENT_FILE, INCOMPLETE} and not any(
        (folder / INCOMPLETE).iterdir()
    ):
        (folder / INCOMPLETE).rmdir()
        (folder / EXPERIMENT_FILE).unlink()
        folder.rmdir()


def next_recording(folder: Path) -> Path:
    """A recording's path among the incomplete ones whose number is not taken anywhere in the experiment."""
    taken = {-1}
    for place in (folder, folder / INCOMPLETE):
        for path in place.glob("session-*"):
            number = re.match(r"session-(\d+)\.", path.name)
            if number:
                taken.add(int(number[1]))
    return folder / INCOMPLETE / f"session-{max(taken) + 1:02d}.h5"


def claim_recording(folder: Path) -> Path:
    """A recording's path as from `next_recording`, whose number is ours from now on: its raw log is made, empty.

    Of two sessions in one folder only one gets a number, whatever process they are in.
    """
    while True:
        path = next_recording(folder)
        try:
            raw_log_of(path).open("x").close()
        except FileExistsError:
            continue
        return path


def give_back(recording: Path) -> None:
    """Remove what `claim_recording` made, where nothing was recorded."""
    log = raw_log_of(recording)
    if not recording.exists() and log.exists() and log.stat().st_size == 0:
        log.unlink()


@contextmanager
def changing(folder: Path) -> Generator[None]:
    """One at a time changes which sessions an experiment lists, whatever process it is in."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def admit(folder: Path, recording: Path, payload: Payload, role: Role) -> Path:
    """Move a complete recording with its raw log into the experiment and list it; where it then stands.

    Raises InputError, and leaves the recording where it is, where the experiment's file is gone or wrong.
    """
    with changing(folder):
        # Read first: a recording that was moved and then cannot be listed would be nobody's.
        read_experiment_file(folder / EXPERIMENT_FILE)
        final = folder / recording.name
        if final.exists():
            raise InputError(f"{final}: already exists; move {recording} by hand")
        log = raw_log_of(recording)
        if log.exists():
            os.replace(log, folder / log.name)
        os.replace(recording, final)
        append_session(folder, DeclaredSession(file=final.name, payload=payload.name, role=role), payload)
    return final
