"""Columns as samples in SI: units given, units of the file, counts, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.recording.errors import InputError
from identify.recording.foreign.roles import ColumnMap, measure, named_roles
from identify.recording.foreign.stated_period import StatedPeriod
from identify.recording.foreign.table import ForeignColumn, ForeignTable
from identify.recording.units import unit_of

N = 64
T = np.arange(N) / 100


def column(name, values, unit=None) -> ForeignColumn:
    known = unit_of(unit) if unit else None
    return ForeignColumn(name, np.array(values, float), None, known, "the header" if known else "")


def table(*more: ForeignColumn, q="", i="") -> ForeignTable:
    return ForeignTable(
        Path("log.csv"), (column("t", T), column("q", 2 * T, q), column("i", 3 * T, i), *more)
    )


def measured(made: ForeignTable | None = None, prismatic=(False,), repair=None, **stated):
    columns = ColumnMap(**({"position": ("q",), "command": ("i",), "time": "t"} | stated))
    return measure(made or table(), columns, prismatic, repair)


def refusal(*arguments, **stated) -> str:
    with pytest.raises(InputError) as refused:
        measured(*arguments, **stated)
    return str(refused.value)


def test_without_a_unit_positions_are_radians_or_metres_and_commands_amperes():
    found = measured()
    np.testing.assert_array_equal(found.time, T)
    np.testing.assert_array_equal(found.position[:, 0], 2 * T)
    np.testing.assert_array_equal(found.command[:, 0], 3 * T)
    assert (found.external, found.temperature, found.extra) == (None, None, {})
    assert found.remarks == ("t: s (no unit is stated)",)


def test_positions_without_a_unit_that_cover_many_turns_are_said_to_be_taken_as_rad():
    """Degrees were taken as rad without a word: a model of 30 % error, and nothing said why."""
    degrees = table(column("angle", 45 * np.sin(10 * T)))
    said = (
        f"angle: taken as rad, as no unit is stated: {np.ptp(45 * np.sin(10 * T)) / (2 * np.pi):.3g} turns;"
    )
    assert any(remark.startswith(said) for remark in measured(degrees, position=("angle",)).remarks)
    for known in (
        measured(degrees, position=("angle",), position_unit=("deg",)),
        measured(degrees, position=("angle",), position_unit=("rad",)),
        measured(degrees, (True,), position=("angle",)),
        measured(table(column("angle", 6 * np.sin(10 * T))), position=("angle",)),
    ):
        assert not any("turns" in remark for remark in known.remarks)


def test_a_unit_that_is_not_known_is_said():
    named = table(column("Lage (Strich)", 2 * T), column("Lage [deg]", 2 * T, "deg"))
    found = measured(named, position=("Lage (Strich)",))
    assert "Lage (Strich): 'Strich' is no unit that is known; taken as rad" in found.remarks
    assert not any("no unit" in said for said in measured(named, position=("Lage [deg]",)).remarks[:-1])
    given = measured(named, position=("Lage (Strich)",), position_unit=("0.001",))
    assert not any("is known" in said for said in given.remarks)


def test_units_of_the_file_hold_unless_others_are_given():
    found = measured(table(q="deg", i="mA"))
    np.testing.assert_allclose(found.position[:, 0], np.deg2rad(2 * T))
    np.testing.assert_allclose(found.command[:, 0], 3e-3 * T)
    assert found.remarks[:2] == (
        "q: deg -> rad (× 0.0174532925) by the header",
        "i: mA -> A (× 0.001) by the header",
    )
    given = measured(table(q="deg"), position_unit=("mrad",), command_unit=("0.5",))
    np.testing.assert_allclose(given.position[:, 0], 2e-3 * T)
    np.testing.assert_allclose(given.command[:, 0], 1.5 * T)


def test_counts_are_turned_by_their_resolution():
    turned = measured(position_unit=("counts",), resolution=(4096.0,))
    np.testing.assert_allclose(turned.position[:, 0], 2 * T * 2 * np.pi / 4096)
    slid = measured(prismatic=(True,), position_unit=("counts",), resolution=(-1000.0,))
    np.testing.assert_allclose(slid.position[:, 0], -2 * T / 1000)
    assert turned.remarks[0] == "q: counts, 4096 a turn, -> rad as given"
    assert slid.remarks[0] == "q: counts, -1000 a metre, -> m as given"
    assert "--resolution is missing: counts per turn of joint 1, as column 'q' is in counts" in refusal(
        position_unit=("counts",)
    )
    assert "--resolution: 0 must be a finite number other than 0" in refusal(
        position_unit=("counts",), resolution=(0.0,)
    )


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        (
            {"position_unit": ("furlong",)},
            "--position-unit: 'furlong' is not known; use a unit of rad (angle)",
        ),
        ({"position_unit": ("mm",)}, "--position-unit: 'mm' is a unit of length; use one of rad (angle)"),
        ({"position_unit": ("0",)}, "--position-unit: '0' must be a finite number other than 0"),
        ({"position_unit": ("rad", "deg", "rad")}, "--position-unit: 3 units for 1 joints; give one, or 1"),
        ({"position": ("q", "q")}, "2 position and 1 command columns for 1 joint; give one of each"),
        (
            {"command": ("q",)},
            "column 'q' (column 2) is given as the position of joint 1 and as the command of joint 1",
        ),
        ({"external": ("q", "i")}, "column 'q' (column 2) is given as"),
        ({"time": None}, "no time column; give --time COLUMN, or --rate HZ above 0"),
        ({"time": None, "rate": 0.0}, "no time column; give --time COLUMN, or --rate HZ above 0"),
        ({"command": ("x",)}, "there is no column 'x'"),
    ],
)
def test_what_is_stated_wrongly_is_refused_with_the_remedy(stated, words):
    assert words in refusal(**stated)


def test_a_unit_of_the_file_that_is_none_of_the_quantity_is_refused():
    assert "column 'q' is in A (current) by the header, which is no position" in refusal(table(q="A"))


def test_a_rate_makes_the_time():
    np.testing.assert_allclose(measured(time=None, rate=250.0).time, np.arange(N) / 250)


def test_without_a_time_column_the_period_that_the_file_states_makes_the_time_unless_a_rate_is_given():
    stating = replace(table(), period=StatedPeriod(0.02, "the file states 0.02 s"))
    found = measured(stating, time=None)
    np.testing.assert_allclose(found.time, np.arange(N) * 0.02)
    assert "no time column: the file states 0.02 s" in found.remarks
    given = measured(stating, time=None, rate=500.0)
    np.testing.assert_allclose(given.time, np.arange(N) / 500)
    assert not any("states" in said for said in given.remarks)
    assert refusal(time=None).endswith("no time column; give --time COLUMN, or --rate HZ above 0")


def test_forces_temperatures_and_further_columns_come_along():
    more = (column("f", 5 * T, "mNm"), column("warm", 20 + T), column("q1", T), column("x y", T, "ms"))
    found = measured(table(*more), external=("f",), temperature=("warm",), extra=("q1", "x y"))
    np.testing.assert_allclose(found.external[:, 0], 5e-3 * T)
    np.testing.assert_allclose(found.temperature[:, 0], 20 + T)
    assert list(found.extra) == ["q1_recorded", "x_y"]
    np.testing.assert_allclose(found.extra["x_y"], 1e-3 * T)
    assert "q1: kept as q1_recorded" in found.remarks


def test_roles_are_named_in_words():
    columns = ColumnMap(("a", "b"), ("c", "d"), "t", external=("e",), temperature=("f",), extra=("g",))
    assert named_roles(columns) == [
        ("t", "the time"),
        ("a", "the position of joint 1"),
        ("b", "the position of joint 2"),
        ("c", "the command of joint 1"),
        ("d", "the command of joint 2"),
        ("e", "the external force of joint 1"),
        ("f", "the temperature of joint 1"),
        ("g", "an extra column"),
    ]


def test_samples_without_a_value_are_refused_left_out_or_bridged():
    made = table()
    assert made.columns[2].numbers is not None
    made.columns[2].numbers[10] = np.nan
    assert "column 'i', sample 11: not a finite number; --repair drop leaves such samples out" in refusal(
        made
    )
    dropped = measured(made, repair="drop")
    np.testing.assert_array_equal(dropped.time, np.delete(T, 10))
    assert "1 of 64 samples without a value left out" in dropped.remarks
    bridged = measured(made, repair="bridge")
    assert len(bridged.time) == N
    np.testing.assert_allclose(bridged.command[10, 0], 3 * T[10])
    assert "1 missing values bridged by interpolation" in bridged.remarks


def test_time_that_does_not_increase_is_refused_with_its_sample():
    made = table()
    assert made.columns[0].numbers is not None
    made.columns[0].numbers[20] = made.columns[0].numbers[19]
    made.columns[0].numbers[40] = 0.0
    assert "column 't', sample 21: time does not increase (1 stamps repeat, 1 go back)" in refusal(made)


def test_columns_of_other_lengths_and_of_words_are_refused():
    short = ForeignTable(Path("log.csv"), (column("t", T), column("q", T), column("i", T[:-1])))
    assert "column 'i' has 63 samples, the first position 64" in refusal(short)
    words = ForeignTable(
        Path("log.csv"), (column("t", T), column("q", T), ForeignColumn("i", None, [""] + ["on"] * 63))
    )
    assert "column 'i' for the command of joint 1 holds words ('on'), not numbers" in refusal(words)
