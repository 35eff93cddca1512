"""`coulomb import`: an experiment from somebody's records."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from api.command_arguments import AsJson, RecordTopic
from identify.recording.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from identify.recording import Experiment, Robot
    from identify.recording.experiment_file import PriorBodies
    from identify.recording.foreign import ColumnMap, CsvOptions, ForeignTable
    from identify.recording.foreign.repair import Repair

Several = list[str] | None


def register(application: typer.Typer) -> None:
    """Add the command."""
    application.command("import")(import_)


def import_(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="Table in text (CSV of any dialect, plain or gzip), MAT, Parquet, MDF or a recording of ROS; each is a session.",
        ),
    ],
    out: Annotated[Path | None, typer.Option(help="Folder of the experiment to make.")] = None,
    append: Annotated[
        bool, typer.Option("--append", help="Add to the experiment in --out; columns as there if not given.")
    ] = False,
    join: Annotated[
        bool, typer.Option("--join", help="All files are one session; join them on their time columns.")
    ] = False,
    name: Annotated[
        str | None, typer.Option(help="Name of the experiment; that of the folder if left out.")
    ] = None,
    time: Annotated[
        Several,
        typer.Option(help="Time column: numbers, dates or times of day. With --join one for each file."),
    ] = None,
    time_unit: Annotated[
        str | None,
        typer.Option(help="s, ms, us, ns, 100ns, min, h, d; told by the file if left out, else s."),
    ] = None,
    rate: Annotated[
        float | None, typer.Option(help="Samples a second, when there is no time column.")
    ] = None,
    position: Annotated[
        Several,
        typer.Option(
            help="Position column of a joint, base to tip: COLUMN, #NUMBER, or q1=COLUMN. Repeat it."
        ),
    ] = None,
    position_unit: Annotated[
        Several,
        typer.Option(
            help="rad, deg, turn, m, mm, counts ..., or a factor; one, or one for each joint. Told by the file if"
            " left out, else rad or m."
        ),
    ] = None,
    resolution: Annotated[
        list[float] | None,
        typer.Option(help="Counts per turn (or metre) of a joint, for positions in counts."),
    ] = None,
    command: Annotated[
        Several,
        typer.Option(help="Column of the current reference (or torque) of a joint: COLUMN, or v1=COLUMN."),
    ] = None,
    command_unit: Annotated[
        Several,
        typer.Option(
            help="A, mA, V, mV, Nm, Nmm, N, percent, counts ..., or a factor; the gain counts in A, V, N m or N."
            " Told by the file if left out, else A."
        ),
    ] = None,
    gain: Annotated[
        Several, typer.Option(help="Joint torque for one unit of command: a number, or a scalar of the file.")
    ] = None,
    external: Annotated[
        Several, typer.Option(help="Column of the known external force of a joint, N m or N.")
    ] = None,
    temperature: Annotated[Several, typer.Option(help="Column of the temperature of a joint, °C.")] = None,
    keep: Annotated[Several, typer.Option(help="Another column to keep.")] = None,
    rig: Annotated[
        str | None,
        typer.Option(
            help="Rig file or name: FILE is a log of CAN frames of that rig (candump, Vector, PEAK, Kvaser ...)."
        ),
    ] = None,
    begin: Annotated[float | None, typer.Option(help="Of a CAN log: s from its first SYNC.")] = None,
    end: Annotated[
        float | None, typer.Option(help="Likewise. Without both: while all drives were enabled.")
    ] = None,
    robot: Annotated[
        Path | None,
        typer.Option(
            help="URDF, SDF or MJCF of the robot, instead of --type, --dh and --joint; its inertias are compared with what is"
            " identified, with --append too."
        ),
    ] = None,
    tip: Annotated[str | None, typer.Option(help="Link of it at which the chain ends.")] = None,
    topic: RecordTopic = None,
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
    header_line: Annotated[
        int | None,
        typer.Option(help="Line that names the columns, from 1; 0: none. Told by the cells if left out."),
    ] = None,
    separator: Annotated[
        str | None, typer.Option(help="Sign between columns, or: comma, semicolon, tab, space.")
    ] = None,
    decimal: Annotated[str | None, typer.Option(help="Decimal sign of all columns: '.' or ','.")] = None,
    repair: Annotated[
        str | None,
        typer.Option(
            help="Samples without a value, stamps that repeat or go back: drop them, or bridge them."
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make an experiment of somebody's records.

    What is not given is asked for, if somebody sits at the terminal. What was decided is said on stderr.
    """
    if rig is not None:
        _import_can_logs(files, rig, out, append, name, payload, role, begin, end, as_json)
        return
    from api.foreign_robot import (
        columns_of_joints,
        each_joint,
        parse_number,
        parse_three,
        typed_robot,
        urdf_robot,
    )
    from identify.recording import Payload
    from identify.recording.experiment_file import EXPERIMENT_FILE, check_settings, read_experiment_file
    from identify.recording.foreign import ColumnMap, CsvOptions, measure
    from identify.recording.foreign.guesses import guess_roles
    from identify.recording.foreign.joining import join_session
    from identify.recording.foreign_import import NewSession, import_sessions, read_columns

    mending = _repair(repair)
    tables = _tables(files, CsvOptions(header_line, separator, decimal), topic)
    folder = out or Path(_asked("--out", "folder of the experiment to make"))
    known = read_experiment_file(folder / EXPERIMENT_FILE) if append else None
    recorded = read_columns(folder) if append else None
    if recorded is None and tables[0].time is not None and not time and rate is None:
        time = [tables[0].time]
    made: Robot | None = None
    prior: PriorBodies | None = None
    if known is None and robot is not None:
        made, prior = urdf_robot(robot, tip, gravity, gain, tables[0].scalars)
    elif known is not None and robot is not None:
        from identify.validation.prior_inertias import prior_of_file

        prior = prior_of_file(robot, tip, known.robot)
    if recorded is None and tables[0].joints and not position and not command:
        wanted = [each.name for each in made.joints] if made else list(tables[0].joints)
        position, command = columns_of_joints(tables[0], wanted)
    if recorded is None:
        probable = guess_roles(tables[0])
        positions = position or _asked_columns(
            "--position", "position columns, base to tip", probable.position
        )
        commands = command or _asked_columns("--command", "columns of the commands", probable.command)
        by_file = probable.time is None and tables[0].period is not None
        if not time and rate is None and not by_file:
            answer = _asked("--time or --rate", "time column, or samples a second", probable.time)
            time, rate = ([answer], None) if tables[0].has(answer) else (None, parse_number(answer, "--rate"))
        recorded = ColumnMap(_in_order(positions, "q", "--position"), _in_order(commands, "v", "--command"))
    columns = _updated(
        recorded,
        position=_in_order(position or [], "q", "--position"),
        command=_in_order(command or [], "v", "--command"),
        time=time[0] if time else None,
        rate=rate,
        time_unit=time_unit,
        position_unit=tuple(position_unit or ()),
        command_unit=tuple(command_unit or ()),
        resolution=tuple(resolution or ()),
        external=_in_order(external or [], "ext", "--external"),
        temperature=_in_order(temperature or [], "temp", "--temperature"),
        extra=tuple(keep or ()),
    )
    n = len(columns.position)
    if known is None and made is None:
        types = each_joint(
            kind or _asked("--type", "revolute or prismatic, for each joint").split(), n, "--type"
        )
        gains = gain or _asked("--gain", "joint torque for one unit of command, for each joint").split()
        made = typed_robot(tables[0].scalars, types, gains, joint, dh, gravity, _asked)
    chain = made or (known.robot if known else None)
    prismatic = [not each.revolute for each in chain.joints] if chain else []
    body = {"name": payload, "mass": payload_mass, "com": list(parse_three(payload_com, "--payload-com"))}
    carried = check_settings(Payload, body, {}, "options: --payload")
    if columns.joined and not time:
        if len(tables) != len(columns.joined):
            named = ", ".join(columns.joined)
            raise InputError(
                f"FILE: sessions of {folder} are joined from {len(columns.joined)} files each (times: {named}); give as many, or"
                " name --time"
            )
        join = True
    if join and len(tables) > 1:
        joined, columns = join_session(tables, time or (), columns, mending)
        tables = [joined]
    elif time and len(time) > 1:
        raise InputError(
            f"--time: {len(time)} given; one is for all files, unless --join makes one session of them"
        )
    count = len(known.sessions) if known else 0
    if session is not None and len(tables) > 1:
        raise InputError(f"--session: one name for {len(tables)} sessions; leave it out")
    sessions = [
        NewSession(
            session or f"session-{count + index:02d}.csv",
            measure(table, columns, prismatic, mending),
            carried,
            role,
        )
        for index, table in enumerate(tables)
    ]
    experiment = import_sessions(sessions, folder, made, name or folder.resolve().name, columns, prior)
    decided = [
        (table.path, each.payload.name, each.role, each.measured.remarks)
        for table, each in zip(tables, sessions, strict=True)
    ]
    _report(experiment, decided, as_json)


def _tables(files: list[Path], options: "CsvOptions", topic: str | None) -> "list[ForeignTable]":
    from identify.recording.foreign import read_foreign

    tables = [read_foreign(file, options, topic) for file in files]
    if sys.stdin.isatty():
        for table in tables:
            typer.echo(f"{table.path} holds the columns {table.names()}", err=True)
            if table.scalars:
                numbers = ", ".join(f"{name} = {value:g}" for name, value in table.scalars.items())
                typer.echo(f"and the numbers {numbers}", err=True)
    return tables


def _repair(given: str | None) -> "Repair | None":
    if given is None or given == "drop" or given == "bridge":
        return given
    raise InputError(f"--repair: '{given}' is not known; give drop or bridge")


def _updated(columns: "ColumnMap", **given: object) -> "ColumnMap":
    """The columns with what was given in place of what was known."""
    return replace(columns, **{name: value for name, value in given.items() if value})  # type: ignore[arg-type]


def _import_can_logs(
    files: list[Path],
    rig: str,
    out: Path | None,
    append: bool,
    name: str | None,
    payload: str,
    role: str,
    begin: float | None,
    end: float | None,
    as_json: bool,
) -> None:
    from api.can_log_import import import_can_logs

    folder = out or Path(_asked("--out", "folder of the experiment to make"))
    experiment, sessions = import_can_logs(
        files, rig, folder, append=append, name=name, payload=payload, role=role, begin=begin, end=end
    )
    decided = [(file, payload, role, session.remarks) for file, session in zip(files, sessions, strict=True)]
    _report(experiment, decided, as_json)


def _report(
    experiment: "Experiment", decided: "Sequence[tuple[Path, str, str, Sequence[str]]]", as_json: bool
) -> None:
    """What was made on stdout, there in one document with what was decided if asked; what was decided on stderr too.

    decided : source, payload, role and remarks of each new session
    """
    entries = experiment.sessions[-len(decided) :]
    document = []
    for (source, payload, role, remarks), entry in zip(decided, entries, strict=True):
        read = experiment.read(entry)
        document.append(
            {
                "file": entry.file,
                "source": str(source),
                "payload": payload,
                "role": role,
                "samples": len(read.time),
                "rate": 1 / read.sampling_period,
                "decided": list(remarks),
                "remarks": list(read.remarks),
            }
        )
        for remark in remarks:
            typer.echo(f"{source.name}: {remark}", err=True)
        if not as_json:
            joints = f"{read.n} joint{'s' if read.n > 1 else ''}"
            rate = f"{1 / read.sampling_period:.6g} Hz"
            typer.echo(f"{experiment.path}: {len(read.time)} samples of {joints} at {rate} in {entry.file}")
            for remark in read.remarks:
                typer.echo(f"  {remark}")
    if as_json:
        print(json.dumps({"experiment": str(experiment.path), "sessions": document}, ensure_ascii=False))


def _asked(option: str, what: str, probable: str | None = None) -> str:
    """Ask at the terminal, where return takes what is probable; without a terminal, say which option is missing."""
    if not sys.stdin.isatty():
        hint = f"; probably '{probable}'" if probable else ""
        raise InputError(f"{option} is missing: {what}{hint}")
    return typer.prompt(f"{what} ({option})", default=probable, err=True)


def _asked_columns(option: str, what: str, probable: tuple[str, ...]) -> list[str]:
    """Likewise several columns, whose names may hold spaces where they are taken as proposed."""
    proposed = "', '".join(probable)
    answer = _asked(option, what, proposed or None)
    return list(probable) if answer == proposed else answer.split()


def _in_order(given: list[str], letter: str, option: str) -> tuple[str, ...]:
    """Columns joint by joint: in the order given, or by number where they are written q1=COLUMN."""
    numbered: dict[int, str] = {}
    for place, item in enumerate(given, start=1):
        label, sign, column = item.partition("=")
        digits = label.removeprefix(letter)
        if sign and digits.isdecimal():
            place, item = int(digits), column
        if place in numbered:
            raise InputError(f"{option}: joint {place} is given twice")
        numbered[place] = item
    if sorted(numbered) != list(range(1, len(numbered) + 1)):
        raise InputError(
            f"{option}: joints {', '.join(map(str, sorted(numbered)))}; number them 1 ... {len(numbered)}"
        )
    return tuple(numbered[place] for place in sorted(numbered))
