"""What the pages show of drives' tables: pictures over the model's curve, objects with their values, and writings in one line."""

from dataclasses import dataclass
from itertools import groupby

from markupsafe import Markup

from api.pages.figures.drive_table import TableLine, draw_drive_table
from api.pages.layout import experiment_link
from api.pages.number_format import significant
from api.pages.sentence import sentence
from api.service.drive_table_documents import TablesWriting
from identify.results.drive_tables import DriveTable, DriveTablesDocument, JointTables

STATES = {
    "begun": ("fault", "cut off"),
    "written": ("good", "written and read back"),
    "refused": ("warn", "refused; all as before"),
}

CUT_OFF = "it did not come to its end: the drives may hold some of both"


@dataclass(frozen=True)
class ObjectsRow:
    """Objects of one index, with their values in the drive's counts."""

    object: str
    type: str
    values: list[str]


@dataclass(frozen=True)
class TableView:
    """One table of a drive: its figures in words, its objects, and the picture, wide and for a phone."""

    of: str
    wanted: str
    left: str
    constant: str | None
    heads: tuple[str, ...]
    points: list[list[str]]
    objects: list[ObjectsRow]
    wide: Markup
    narrow: Markup


@dataclass(frozen=True)
class JointTablesView:
    """One joint's drive with its tables."""

    node: int
    drive: str
    tables: list[TableView]
    remarks: list[str]


@dataclass(frozen=True)
class WritingRow:
    """One writing in a list; `back_link` takes it back, None where there is nothing to take back."""

    number: str
    of: str
    rig: str
    tone: str
    outcome: str
    reason: str
    operator: str
    created: str
    back_link: str | None


def joint_tables(tables: DriveTablesDocument, joint: str) -> JointTablesView | None:
    """One joint's drive with its tables; None where the rig has no such joint."""
    own_tables = next((each for each in tables.joints if each.joint == joint), None)
    if own_tables is None:
        return None
    return JointTablesView(
        node=own_tables.node,
        drive=own_tables.drive,
        tables=[_table(own_tables, each) for each in own_tables.tables],
        remarks=[sentence(remark) for remark in (*own_tables.remarks, *tables.remarks)],
    )


def _table(joint: JointTables, table: DriveTable) -> TableView:
    friction = table.of == "friction"
    drawn = _friction_line(joint, table) if friction else _cogging_line(joint, table)
    return TableView(
        of=table.of,
        wanted=significant(table.wanted),
        left=significant(table.left),
        constant=(None if table.constant is None else significant(table.constant)),
        heads=(("rad/s of the motor", "A forward", "A backward") if friction else ("of a turn", "A")),
        points=[[significant(value, 4) for value in point] for point in table.points],
        objects=_objects(table),
        wide=draw_drive_table(drawn, width=860, height=290),
        narrow=draw_drive_table(drawn, width=350),
    )


def _objects(table: DriveTable) -> list[ObjectsRow]:
    """The objects in rows of one index, with their values in the drive's counts."""
    rows: list[ObjectsRow] = []
    for index, same in groupby(table.objects, key=lambda each: each.object.partition(":")[0]):
        objects = list(same)
        first, last = (each.object.partition(":")[2] for each in (objects[0], objects[-1]))
        rows.append(
            ObjectsRow(
                object=f"{index}:{first}" + (f" to {last}" if last != first else ""),
                type=objects[0].type,
                values=[f"{each.value:.9g}".replace("-", "−") for each in objects],
            )
        )
    return rows


def _friction_line(joint: JointTables, table: DriveTable) -> TableLine:
    """Straight through the support points of either direction, through zero between, held to the record's top speed."""
    constant = table.constant or 0.0
    forward = [(speed, ahead + constant) for speed, ahead, _ in table.points]
    backward = [(-speed, back + constant) for speed, _, back in reversed(table.points)]
    ends = [abs(row[0]) for row in table.model] + [forward[-1][0]]
    return TableLine(
        f"Friction table of {joint.joint} over the speed of its motor, and the model's friction",
        "speed of the motor, rad/s",
        [*backward, *forward],
        [(-max(ends), backward[0][1]), *backward, (0.0, constant), *forward, (max(ends), forward[-1][1])],
        table.model,
    )


def _cogging_line(joint: JointTables, table: DriveTable) -> TableLine:
    points = [(turn, current) for turn, current in table.points]
    return TableLine(
        f"Cogging table of {joint.joint} over a turn of its motor, and the model's",
        "turn of the motor",
        points,
        [*points, (1.0, points[0][1])],
        table.model,
    )


def writing_row(experiment: str, writing: TablesWriting) -> WritingRow:
    """One writing in a list."""
    tone, outcome = STATES[writing.state]
    of = f"model {writing.version}" if writing.version else f"what was before {writing.undoes}"
    return WritingRow(
        number=writing.number,
        of=of,
        rig=writing.rig,
        tone=tone,
        outcome=outcome,
        reason=(CUT_OFF if writing.state == "begun" else writing.reason),
        operator=writing.operator,
        created=writing.created,
        back_link=(
            experiment_link(experiment, f"drive-tables/writings/{writing.number}/back")
            if writing.state != "refused"
            else None
        ),
    )
