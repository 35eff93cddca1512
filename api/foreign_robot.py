"""The robot of an imported experiment: typed joint by joint, or from a URDF."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from identify.recording import InputError, Robot
from identify.recording.experiment_file import PriorBodies, check_settings
from identify.recording.foreign import ForeignTable

Ask = Callable[[str, str], str]
"""(option, what it is) -> the answer; raises InputError where nobody can answer"""


def each_joint(given: Sequence[str], n: int, option: str) -> list[str]:
    """One value for every joint: as many as joints, or one for all.

    Raises InputError: neither.
    """
    if len(given) not in (1, n):
        raise InputError(
            f"{option}: {len(given)} given for {n} joint{'s' if n > 1 else ''}; give one, or {n}"
        )
    return list(given) * (n // len(given))


def parse_number(text: str, option: str) -> float:
    """A number given on the command line.

    Raises InputError: it is none.
    """
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{option}: '{text}' is not a number") from None


def parse_three(text: str, option: str) -> tuple[float, float, float]:
    """x,y,z given on the command line."""
    x, y, z = _numbers(text, 3, option)
    return x, y, z


def typed_robot(
    scalars: dict[str, float],
    types: list[str],
    gains: list[str],
    names: list[str] | None,
    dh: list[str] | None,
    gravity: str | None,
    ask: Ask,
) -> Robot:
    """The robot that options describe joint by joint.

    scalars : numbers of the imported file, which a gain may name
    """
    n = len(types)
    labels = names or [f"j{index + 1}" for index in range(n)]
    if len(labels) != n:
        raise InputError(f"--joint: {len(labels)} names for {n} joints")
    frames = [_numbers(frame, 4, "--dh") for frame in dh] if dh else [[0.0] * 4]
    if n > 1 and len(frames) != n:
        raise InputError(
            f"--dh: {len(frames) if dh else 0} frames for {n} joints; give alpha,d,theta,r of each, or --robot"
        )
    joints = []
    values = gain_values(scalars, gains, n)
    for label, kind, gain, frame in zip(labels, types, values, frames, strict=True):
        alpha, d, theta, r = frame
        joints.append(
            {"name": label, "type": kind, "alpha": alpha, "d": d, "theta": theta, "r": r, "drive_gain": gain}
        )
    given = gravity or ask("--gravity", "gravity in the base frame, x,y,z in m/s²")
    document = {"gravity": list(parse_three(given, "--gravity")), "joints": joints}
    return check_settings(Robot, document, {}, "options: robot")


def urdf_robot(
    urdf: Path, tip: str | None, gravity: str | None, gains: list[str] | None, scalars: dict[str, float]
) -> tuple[Robot, PriorBodies | None]:
    """The robot of a URDF, and its links' bodies where it states any; without gains the commands are joint torques.

    Raises InputError: names the file and element, or the option.
    """
    from identify.dynamics.urdf import EARTH, read_urdf

    down = parse_three(gravity, "--gravity") if gravity else EARTH
    read = read_urdf(urdf, tip=tip, gravity=down)
    if gains:
        values = gain_values(scalars, gains, len(read.robot.joints))
        read = read_urdf(urdf, tip=tip, gravity=down, drive_gains=values)
    return read.robot, read.prior(urdf.name)


def columns_of_joints(table: ForeignTable, joints: Sequence[str]) -> tuple[list[str], list[str]]:
    """Columns of the positions and efforts of joints, by their names in the robot.

    Raises InputError: the recording has no positions or no efforts of one of them, or has them on several topics.
    """
    if table.undecided:
        raise InputError(f"{table.path}: {table.undecided}; say which: --topic NAME")
    columns: tuple[list[str], list[str]] = ([], [])
    for joint in joints:
        for names, what in zip(columns, ("position", "effort"), strict=True):
            name = f"{joint}.{what}"
            if not table.has(name) or np.isnan(table.column(name, "a joint").numbers).all():  # type: ignore[arg-type]
                raise InputError(
                    f"{table.path}: holds no {what} of joint '{joint}'; it has the joints {', '.join(table.joints)}:"
                    " name columns by --position and --command"
                )
            names.append(name)
    return columns


def gain_values(scalars: dict[str, float], gains: list[str], n: int) -> list[float]:
    """Drive gains given as numbers or as the name of a number in the file, one for each joint."""
    return [
        scalars[gain] if gain in scalars else parse_number(gain, "--gain")
        for gain in each_joint(gains, n, "--gain")
    ]


def _numbers(text: str, count: int, option: str) -> list[float]:
    numbers = [parse_number(part, option) for part in text.split(",")]
    if len(numbers) != count:
        raise InputError(
            f"{option}: '{text}' has {len(numbers)} numbers; {count} are needed, separated by ','"
        )
    return numbers
