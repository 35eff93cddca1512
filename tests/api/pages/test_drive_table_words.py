"""What the pages say of drives' tables and of writings."""

import re

import pytest

from api.pages.drive_table_words import joint_tables, writing_row
from api.service.drive_table_documents import TablesWriting
from identify.results.drive_tables import DriveTable, DriveTablesDocument, JointTables, TableObject
from tests.api.pages.path_points import points_of


def objects(*named: tuple[str, float]) -> tuple[TableObject, ...]:
    return tuple(TableObject(object=name, type="int32", value=value, before=None) for name, value in named)


FRICTION = DriveTable(
    of="friction",
    points=((10.0, 1.0, -2.0), (50.0, 3.0, -4.0)),
    model=((-100.0, -4.0, -4.5, -3.5), (20.0, 1.5, 1.0, 2.0), (100.0, 3.0, 2.5, 3.5)),
    constant=0.5,
    wanted=2.0,
    left=0.25,
    objects=objects(("0x2020:01", 95.0), ("0x2020:02", 12345.0), ("0x2023:00", -500.0)),
)
COGGING = FRICTION.changed(
    of="cogging", points=((0.0, 0.1), (0.5, -0.1)), model=((0.25, 0.0, -0.1, 0.1),), constant=None, objects=()
)
DOCUMENT = DriveTablesDocument(
    experiment="e",
    rig="bench",
    model="usual",
    written=False,
    joints=(
        JointTables(
            joint="j1", node=3, drive="simulated", tables=(FRICTION, COGGING), remarks=("they act.",)
        ),
    ),
    remarks=("a remark",),
)


def test_the_line_goes_through_zero_speed_at_the_constant_and_is_held_beyond_the_last_point() -> None:
    shown = joint_tables(DOCUMENT, "j1")
    assert shown is not None
    drawing = shown.tables[0].wide
    (data,) = re.findall(r'<path d="([^"]+)" class="curve"/>', drawing)
    line = points_of(data)
    assert len(line) == 7
    assert line[0, 1] == line[1, 1]
    assert line[-1, 1] == line[-2, 1]
    across = line[:, 0] - line[3, 0]
    assert across[-1] / across[4] == pytest.approx(10.0, rel=0.01)
    assert len(re.findall("<circle", drawing)) == 4
    # the model's curve is not joined over standstill
    assert len(re.findall('class="curve measured"', drawing)) >= 1


def test_objects_of_one_index_are_one_row_and_remarks_are_sentences() -> None:
    shown = joint_tables(DOCUMENT, "j1")
    assert shown is not None
    rows = shown.tables[0].objects
    assert [(row.object, row.values) for row in rows] == [
        ("0x2020:01 to 02", ["95", "12345"]),
        ("0x2023:00", ["−500"]),
    ]
    assert shown.remarks == ["They act.", "A remark."]
    assert joint_tables(DOCUMENT, "j9") is None


@pytest.mark.parametrize(
    ("state", "can_be_taken_back"), [("begun", True), ("written", True), ("refused", False)]
)
def test_what_changed_the_drives_can_be_taken_back(state: str, can_be_taken_back: bool) -> None:
    writing = TablesWriting(
        number="03",
        state=state,
        reason="",
        version=None,
        undoes="02",
        rig="bench",
        operator="ada",
        created="2026-11-28T09:00:00+00:00",
        tables=DOCUMENT,
    )
    row = writing_row("e", writing)
    assert row.of == "what was before 02"
    assert (row.back_link is not None) == can_be_taken_back
