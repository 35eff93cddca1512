"""Other people's records: drop files, see their columns, say which is what, and see the first fit."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, TypeVar

from fastapi import APIRouter, File, Form, Request, UploadFile
from fastapi.responses import HTMLResponse, Response
from markupsafe import Markup
from pydantic import BaseModel, ValidationError

from api.pages.figures.column_outline import column_outline
from api.pages.form_input import input_errors_as_problems
from api.pages.layout import experiment_link, frame
from api.pages.rendering import PREFIX, Context, page
from api.pages.sentence import sentence
from api.service import access
from api.service.experiment_upload import UploadedFile, uploaded
from api.service.problems import Problem
from api.service.record_documents import CanLogImport, Dialect, RecordColumn, RecordDescription, RecordImport
from api.service.request_body import FORM_OF_RECORDS, MOST_RECORDS
from identify.recording.first_fault import fault_of
from identify.results.document import Json

router = APIRouter(prefix=f"{PREFIX}/records", include_in_schema=False, form_limits=FORM_OF_RECORDS)

Files = Annotated[list[UploadFile], File(max_length=MOST_RECORDS)]
Word = Annotated[str, Form(max_length=200)]
Words = Annotated[list[str], Form()]
MOST_JOINTS = 32
Document = TypeVar("Document", bound=BaseModel)
UNITS = {
    "position_unit": ("rad", "deg", "turn", "mrad", "m", "mm", "counts"),
    "command_unit": ("A", "mA", "V", "mV", "Nm", "Nmm", "N", "percent", "permille", "counts"),
    "time_unit": ("s", "ms", "us", "ns", "100ns", "min", "h", "d"),
}


@dataclass(frozen=True)
class JointRow:
    """What the form says of one joint."""

    position: str
    command: str


@dataclass(frozen=True)
class Target:
    """An experiment that sessions may be added to."""

    id: str
    name: str


@router.get("")
def records_page(request: Request, user: access.Viewer) -> HTMLResponse:
    """The form, before any file."""
    service = access.service_of(request)
    context = frame(request, user, "experiments")
    return page(
        request,
        "records.html",
        **context,
        rigs=sorted(service.rigs.files()),
        targets=_targets(request),
        here_link=f"{PREFIX}/records",
        upload_limit=service.settings.upload_limit,
    )


@router.post("/columns")
def columns(
    request: Request,
    _user: access.Operator,
    files: Files,
    header_line: Word = "",
    separator: Word = "",
    decimal: Word = "",
    joint_count: Word = "",
    looked_at: Word = "",
) -> HTMLResponse:
    """The columns of the files, and the form for their roles, filled with what is probable."""
    given = _given(files)
    with input_errors_as_problems():
        dialect = _dialect(header_line, separator, decimal)
        described = access.service_of(request).uploads.describe_records(given, dialect)
    first = described[0]
    key = f"{first.file} {dialect.model_dump_json()}"[:200]
    count = max(len(first.position), 1)
    if joint_count and looked_at == key:
        count = int(_number(joint_count, "Joints", whole=True))
        if not 1 <= count <= MOST_JOINTS:
            raise Problem(422, f"Joints: {count} is not between 1 and {MOST_JOINTS}.")
    return page(request, "records_columns.html", targets=_targets(request), **_shown(described, count, key))


@router.post("")
def make(
    request: Request,
    user: access.Operator,
    files: Files,
    name: Word,
    position: Words,
    command: Words,
    gain: Words,
    position_unit: Words,
    command_unit: Words,
    resolution: Words,
    type: Words,
    dh: Words,
    joint_name: Words,
    payload: Words,
    mass: Words,
    time: Words,
    external: Words,
    temperature: Words,
    keep: Annotated[list[str] | None, Form()] = None,
    experiment: Word = "",
    role: Literal["identification", "validation"] = "identification",
    robot: Annotated[UploadFile | None, File()] = None,
    time_unit: Word = "",
    rate: Word = "",
    gravity: Word = "",
    tip: Word = "",
    repair: Literal["", "drop", "bridge"] = "",
    join: bool = False,
    header_line: Word = "",
    separator: Word = "",
    decimal: Word = "",
) -> Response:
    """Make the experiment; it is identified at once, and the page of its model follows."""
    service = access.service_of(request)
    from_file = uploaded(robot) if robot is not None and robot.filename else None
    for place, factor in enumerate(gain, start=1):
        if not factor.strip() and not experiment and (from_file is None or any(gain)):
            raise Problem(
                422,
                f"Gain of joint {place} is missing: joint torque for one unit of command; 1 where that is a torque.",
            )
    with input_errors_as_problems():
        dialect = _dialect(header_line, separator, decimal)
        joints = [
            {
                "name": called.strip() or None,
                "position": where,
                "position_unit": unit_of_position or None,
                "resolution": _number(counts, "Counts per turn") if counts.strip() else None,
                "command": what,
                "command_unit": unit_of_command or None,
                "external": force or None,
                "temperature": warmth or None,
                "gain": _number(factor, "Gain") if factor.strip() else None,
                "type": kind,
                "dh": _numbers(frame_, 4, "Denavit-Hartenberg") if frame_.strip() else (0.0,) * 4,
            }
            for called, where, unit_of_position, counts, what, unit_of_command, force, warmth, factor, kind, frame_ in zip(
                joint_name,
                position,
                position_unit,
                resolution,
                command,
                command_unit,
                external,
                temperature,
                gain,
                type,
                dh,
                strict=True,
            )
        ]
        times = [each for each in time if each]
        wanted = {
            "name": name.strip() or "records",
            "experiment": experiment or None,
            "role": role,
            "keep": keep or [],
            "joints": joints,
            "time": times if join and len(files) > 1 else times[:1],
            "time_unit": time_unit or None,
            "rate": _number(rate, "Samples a second") if rate.strip() else None,
            "payloads": [
                {"name": label.strip() or "none", "mass": _number(kg, "Mass") if kg.strip() else 0.0}
                for label, kg in zip(payload, mass, strict=True)
            ][: 1 if join else None],
            "join": join,
            "repair": repair or None,
            "gravity": _numbers(gravity, 3, "Gravity") if gravity.strip() else None,
            "tip": tip.strip() or None,
            "dialect": dialect,
        }
        settings = _checked(wanted, RecordImport)
        service.jobs.refuse_more(user.name)
        service.disk.require_room()
        row, _ = service.uploads.add_records(_given(files), from_file, settings)
    service.models.refit(row.id, user.name)
    return Response(status_code=204, headers={"HX-Redirect": experiment_link(row.id, "model")})


@router.post("/can")
def make_of_can_logs(
    request: Request,
    user: access.Operator,
    files: Files,
    rig: Word,
    payload: Word = "none",
    name: Word = "",
    experiment: Word = "",
    role: Literal["identification", "validation"] = "identification",
    begin: Word = "",
    end: Word = "",
) -> Response:
    """Make an experiment of CAN logs by a rig's mapping, or add them to one; the page of its model follows."""
    service = access.service_of(request)
    given = _given(files)
    wanted = {
        "rig": rig,
        "payload": payload.strip() or "none",
        "name": name.strip() or given[0].name.partition(".")[0][:100] or "records",
        "experiment": experiment or None,
        "role": role,
        "begin": _number(begin, "Begin") if begin.strip() else None,
        "end": _number(end, "End") if end.strip() else None,
    }
    with input_errors_as_problems():
        settings = _checked(wanted, CanLogImport)
        service.jobs.refuse_more(user.name)
        service.disk.require_room()
        row, _ = service.uploads.add_can_logs(given, service.rigs.file(rig), settings)
    service.models.refit(row.id, user.name)
    return Response(status_code=204, headers={"HX-Redirect": experiment_link(row.id, "model")})


def _targets(request: Request) -> list[Target]:
    return [Target(row.id, row.name) for row in access.service_of(request).experiments.rows()]


def _given(files: Sequence[UploadFile]) -> list[UploadedFile]:
    """The files of the form. Raises the problem 422 where none was chosen."""
    given = [uploaded(file) for file in files if file.filename]
    if not given:
        raise Problem(422, "Choose a file first.")
    return given


def _dialect(header_line: str, separator: str, decimal: str) -> Dialect:
    wanted = {
        "header_line": _number(header_line, "Header line", whole=True) if header_line.strip() else None,
        "separator": separator.strip() or None,
        "decimal": decimal or None,
    }
    return _checked(wanted, Dialect)


def _checked(wanted: Json, kind: type[Document]) -> Document:
    """The document of what was typed. Raises the problem 422, which names the field."""
    try:
        return kind.model_validate(wanted)
    except ValidationError as error:
        place, mistake = fault_of(error)
        field = " ".join(str(part + 1) if isinstance(part, int) else part.replace("_", " ") for part in place)
        raise Problem(422, sentence(f"{field}: {mistake}")) from error


def _number(typed: str, field: str, whole: bool = False) -> float:
    """A number as people type it, also with a decimal comma. Raises the problem 422."""
    try:
        return int(typed) if whole else float(typed.strip().replace(",", "."))
    except ValueError:
        raise Problem(422, f"{field}: “{typed}” is not a number.") from None


def _numbers(typed: str, count: int, field: str) -> tuple[float, ...]:
    """Numbers between spaces or semicolons, or commas where none has a decimal comma."""
    parts = typed.replace(";", " ").split()
    if len(parts) == 1:
        parts = typed.split(",")
    if len(parts) != count:
        raise Problem(422, f"{field}: “{typed}” is not {count} numbers with spaces between.")
    return tuple(_number(part.strip(","), field) for part in parts)


@dataclass(frozen=True)
class ShownRecord:
    """What one file holds; each column with its outline and what it probably is."""

    file: str
    decided: list[str]
    left_off: int
    time: str | None
    rate: float | None
    columns: list[tuple[RecordColumn, Markup, str]]


def _shown(described: list[RecordDescription], count: int, key: str) -> Context:
    first = described[0]
    rows = [
        JointRow(
            first.position[place] if place < len(first.position) else "",
            first.command[place] if place < len(first.command) else "",
        )
        for place in range(count)
    ]
    return {
        "records": [
            ShownRecord(
                file=each.file,
                decided=each.decided,
                left_off=each.left_off,
                time=each.time,
                rate=each.rate,
                columns=[
                    (column, column_outline(column), _role(each, column.name)) for column in each.columns
                ],
            )
            for each in described
        ],
        "names": list(dict.fromkeys(column.name for each in described for column in each.columns)),
        "numeric": list(
            dict.fromkeys(c.name for each in described for c in each.columns if c.smallest is not None)
        ),
        "time": first.time or "",
        "rows": rows,
        "units": UNITS,
        "key": key,
        "suggested": first.file.partition(".")[0].replace("_", "-"),
        "here_link": f"{PREFIX}/records",
    }


def _role(record: RecordDescription, name: str) -> str:
    """What a column probably is, in words; "" for nothing."""
    if name == record.time:
        return "time"
    for role, names in (("position", record.position), ("command", record.command)):
        if name in names:
            return role if len(names) == 1 else f"{role} {names.index(name) + 1}"
    return ""
