"""`coulomb import`: an experiment from somebody's CSV or MAT file."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from identify.recording.errors import InputError

if TYPE_CHECKING:
    from identify.recording import Robot

Several = list[str] | None


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("import")(import_)


def import_(
    file: Annotated[
        Path, typer.Argument(help="CSV (any delimiter, plain or gzip) or MAT file (any version).")
    ],
    out: Annotated[Path | None, typer.Option(help="Folder of the experiment to make.")] = None,
    append: Annotated[
        bool, typer.Option("--append", help="Add a session to the experiment in --out.")
    ] = False,
    name: Annotated[
        str | None, typer.Option(help="Name of the experiment; that of the folder if left out.")
    ] = None,
    time: Annotated[str | None, typer.Option(help="Time column.")] = None,
    time_unit: Annotated[str, typer.Option(help="s, ms, us or ns.")] = "s",
    rate: Annotated[
        float | None, typer.Option(help="Samples a second, when there is no time column.")
    ] = None,
    position: Annotated[
        Several,
        typer.Option(help="Position column of a joint, base to tip: COLUMN, or q1=COLUMN. Repeat it."),
    ] = None,
    position_unit: Annotated[
        Several,
        typer.Option(help="rad, deg, mrad, turn, m, mm, um, or a factor; one, or one for each joint."),
    ] = None,
    command: Annotated[
        Several,
        typer.Option(help="Column of the current reference (or torque) of a joint: COLUMN, or v1=COLUMN."),
    ] = None,
    command_unit: Annotated[
        Several,
        typer.Option(help="A, mA, V, mV, Nm, N, percent, or a factor; the gain counts in A, V, Nm or N."),
    ] = None,
    gain: Annotated[
        Several, typer.Option(help="Joint torque for one unit of command: a number, or a scalar of the file.")
    ] = None,
    external: Annotated[
        Several, typer.Option(help="Column of the known external force of a joint, N m or N.")
    ] = None,
    temperature: Annotated[Several, typer.Option(help="Column of the temperature of a joint, °C.")] = None,
    keep: Annotated[Several, typer.Option(help="Another column to keep.")] = None,
    joint: Annotated[Several, typer.Option(help="Name of a joint; j1, j2 ... if left out.")] = None,
    kind: Annotated[
        Several, typer.Option("--type", help="revolute or prismatic; one, or one for each joint.")
    ] = None,
    dh: Annotated[
        Several,
        typer.Option(help="alpha,d,theta,r of a joint (modified Denavit-Hartenberg; rad, m). Repeat it."),
    ] = None,
    gravity: Annotated[str | None, typer.Option(help="x,y,z in the base frame, m/s².")] = None,
    payload: Annotated[str, typer.Option(help="Name of the payload carried.")] = "none",
    payload_mass: Annotated[float, typer.Option(help="kg")] = 0.0,
    payload_com: Annotated[
        str, typer.Option(help="x,y,z of its centre of mass in the last link's frame, m.")
    ] = "0,0,0",
    role: Annotated[str, typer.Option(help="identification or validation.")] = "identification",
    session: Annotated[str | None, typer.Option(help="Name of the session's file.")] = None,
) -> None:
    """Make an experiment of somebody's CSV or MAT file.

    What is not given is asked for, if somebody sits at the terminal.
    """
    from identify.recording import Payload
    from identify.recording.experiment_file import EXPERIMENT_FILE, check_settings, read_experiment_file
    from identify.recording.foreign import read_foreign
    from identify.recording.foreign_import import ColumnMap, import_session

    table = read_foreign(file)
    if sys.stdin.isatty():
        typer.echo(f"{file} holds the columns {table.names()}", err=True)
        if table.scalars:
            typer.echo(
                f"and the numbers {', '.join(f'{k} = {v:g}' for k, v in table.scalars.items())}", err=True
            )
    folder = out or Path(_asked("--out", "folder of the experiment to make"))
    known = read_experiment_file(folder / EXPERIMENT_FILE) if append else None
    positions = _in_order(
        position or _asked("--position", "position columns, base to tip").split(), "q", "--position"
    )
    commands = _in_order(command or _asked("--command", "columns of the commands").split(), "v", "--command")
    if time is None and rate is None:
        answer = _asked("--time or --rate", "time column, or samples a second")
        time, rate = (answer, None) if answer in table.columns else (None, _number(answer, "--rate"))
    revolute = _each(kind or [], len(positions), "--type") if kind else []
    if not revolute and known is None:
        revolute = _each(
            _asked("--type", "revolute or prismatic, for each joint").split(), len(positions), "--type"
        )
    columns = ColumnMap(
        position=positions,
        command=commands,
        time=time,
        rate=rate,
        time_unit=time_unit,
        position_unit=tuple(position_unit or ["rad" if known or "revolute" in revolute else "m"]),
        command_unit=tuple(command_unit or ["A"]),
        external=_in_order(external or [], "ext", "--external"),
        temperature=_in_order(temperature or [], "temp", "--temperature"),
        extra=tuple(keep or []),
    )
    robot = None
    if known is None:
        gains = gain or _asked("--gain", "joint torque for one unit of command, for each joint").split()
        robot = _robot(table.scalars, revolute, gains, joint, dh, gravity)
    body = {"name": payload, "mass": payload_mass, "com": list(_three(payload_com, "--payload-com"))}
    carried = check_settings(Payload, body, {}, "options: --payload")
    count = len(known.sessions) if known else 0
    experiment = import_session(
        table=table,
        columns=columns,
        folder=folder,
        session_file=session or f"session-{count:02d}.csv",
        payload=carried,
        role=role,
        robot=robot,
        name=name or folder.resolve().name,
    )
    read = experiment.read(experiment.sessions[-1])
    typer.echo(
        f"{experiment.path}: {len(read.time)} samples of {read.n} joint{'s' if read.n > 1 else ''}"
        f" at {1 / read.sampling_period:.6g} Hz in {read.entry.file}"
    )
    for remark in read.remarks:
        typer.echo(f"  {remark}")


def _asked(option: str, what: str) -> str:
    """Ask at the terminal; without one, say which option is missing."""
    if not sys.stdin.isatty():
        raise InputError(f"{option} is missing: {what}")
    return typer.prompt(f"{what} ({option})", err=True)


def _in_order(given: list[str], letter: str, option: str) -> tuple[str, ...]:
    """Columns joint by joint: in the order given, or by number where they are written q1=COLUMN."""
    numbered: dict[int, str] = {}
    for place, item in enumerate(given, start=1):
        label, sign, column = item.partition("=")
        digits = label.removeprefix(letter)
        if sign and digits.isdigit():
            place, item = int(digits), column
        if place in numbered:
            raise InputError(f"{option}: joint {place} is given twice")
        numbered[place] = item
    if sorted(numbered) != list(range(1, len(numbered) + 1)):
        raise InputError(
            f"{option}: joints {', '.join(map(str, sorted(numbered)))}; number them 1 ... {len(numbered)}"
        )
    return tuple(numbered[place] for place in sorted(numbered))


def _each(given: list[str], n: int, option: str) -> list[str]:
    """One value for every joint: as many as joints, or one for all."""
    if len(given) not in (1, n):
        raise InputError(
            f"{option}: {len(given)} given for {n} joint{'s' if n > 1 else ''}; give one, or {n}"
        )
    return given * (n // len(given))


def _robot(
    scalars: dict[str, float],
    types: list[str],
    gains: list[str],
    names: list[str] | None,
    dh: list[str] | None,
    gravity: str | None,
) -> "Robot":
    from identify.recording import Robot
    from identify.recording.experiment_file import check_settings

    n = len(types)
    labels = names or [f"j{index + 1}" for index in range(n)]
    if len(labels) != n:
        raise InputError(f"--joint: {len(labels)} names for {n} joints")
    frames = [_numbers(frame, 4, "--dh") for frame in dh] if dh else [[0.0] * 4]
    if n > 1 and len(frames) != n:
        raise InputError(
            f"--dh: {len(frames) if dh else 0} frames for {n} joints; give alpha,d,theta,r of each"
        )
    joints = []
    for label, kind, gain, frame in zip(labels, types, _each(gains, n, "--gain"), frames, strict=True):
        alpha, d, theta, r = frame
        value = scalars[gain] if gain in scalars else _number(gain, "--gain")
        joints.append(
            {"name": label, "type": kind, "alpha": alpha, "d": d, "theta": theta, "r": r, "drive_gain": value}
        )
    given = gravity or _asked("--gravity", "gravity in the base frame, x,y,z in m/s²")
    document = {"gravity": list(_three(given, "--gravity")), "joints": joints}
    return check_settings(Robot, document, {}, "options: robot")


def _number(text: str, option: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{option}: '{text}' is not a number") from None


def _numbers(text: str, count: int, option: str) -> list[float]:
    found = [_number(part, option) for part in text.split(",")]
    if len(found) != count:
        raise InputError(f"{option}: '{text}' has {len(found)} numbers; {count} are needed, separated by ','")
    return found


def _three(text: str, option: str) -> tuple[float, float, float]:
    x, y, z = _numbers(text, 3, option)
    return x, y, z
