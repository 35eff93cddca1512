"""What columns probably are, told by names and units as machines write them."""

import numpy as np
import pytest

from identify.recording.foreign import ForeignColumn, ForeignTable, read_foreign
from identify.recording.foreign.guesses import guess_roles
from identify.recording.units import split_name


def table_of(*names, joints=()):
    columns = []
    for name in names:
        unit = split_name(name)[1]
        columns.append(ForeignColumn(name, np.arange(5.0), unit=unit, unit_source="its name"))
    return ForeignTable("record.csv", tuple(columns), joints=joints)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("names", "time", "position", "command"),
    [
        (["t", "q1", "q2", "v1", "v2"], "t", ("q1", "q2"), ("v1", "v2")),
        (
            ["Zeit [ms]", "Sollposition [Grad]", "Istposition [Grad]", "Drehzahl [rpm]", "Motorstrom [mA]"],
            "Zeit [ms]",
            ("Istposition [Grad]",),
            ("Motorstrom [mA]",),
        ),
        (
            [
                "timestamp",
                "target_q_1",
                "target_q_0",
                "actual_q_1",
                "actual_q_0",
                "actual_current_1",
                "actual_current_0",
            ],
            "timestamp",
            ("actual_q_0", "actual_q_1"),
            ("actual_current_0", "actual_current_1"),
        ),
        (
            [
                "stamp",
                "shoulder_position",
                "elbow_position",
                "shoulder_velocity",
                "shoulder_effort",
                "elbow_effort",
            ],
            "stamp",
            ("shoulder_position", "elbow_position"),
            ("shoulder_effort", "elbow_effort"),
        ),
        (["time", "dq1", "temp1", "q1_des", "tau_J1", "q_J1"], "time", ("q_J1",), ("tau_J1",)),
        (["n", "A", "B"], "n", (), ()),
        (["x [m]", "f [N]"], None, ("x [m]",), ("f [N]",)),
    ],
)
def test_roles_are_told_by_names_and_units(names, time, position, command):
    roles = guess_roles(table_of(*names))
    assert (roles.time, roles.position, roles.command) == (time, position, command)


def test_a_file_that_knows_of_joints_says_it_itself():
    names = ["a.position", "b.position", "a.effort", "b.effort", "q1"]
    roles = guess_roles(table_of(*names, joints=("b", "a")))
    assert roles.position == ("b.position", "a.position")
    assert roles.command == ("b.effort", "a.effort")


def test_columns_of_one_name_are_told_by_their_number():
    roles = guess_roles(table_of("t", "position", "current", "current"))
    assert roles.command == ()
    assert roles.position == ("position",)


def test_a_date_beside_times_of_day_is_not_the_time(tmp_path):
    rows = "".join(f"2026-11-27,14:03:0{k}.5,{k},{-k}\n" for k in range(10))
    (tmp_path / "log.csv").write_text(f"Date,Time,q,i\n{rows}")
    assert guess_roles(read_foreign(tmp_path / "log.csv")).time == "Time"
