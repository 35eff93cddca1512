"""Exports of TwinCAT Scope, as its exporter writes them."""

import numpy as np
import pytest

from identify.recording import InputError
from identify.recording.foreign import ColumnMap, measure, read_foreign

FAST = np.arange(400) * 1.0
"""ms"""
SLOW = np.arange(200) * 2.0


def position(milliseconds):
    return np.round(10 * np.sin(milliseconds / 50), 6)


def current(milliseconds):
    return np.round(2 * np.cos(milliseconds / 40), 6)


def pairs(sign, decimal, second):
    """One time column before each channel, all header rows; the second channel on its own times."""
    rows = [["Name", "project"], ["File", "a.svdx"], ["Starttime of export", "133000000000000000"], []]
    rows += [["Name", "Axis1.ActPos", "Name", "Axis1.ActCurr"], ["SymbolComment", "", "SymbolComment", ""]]
    rows += [["Data-Type", "REAL64", "Data-Type", "REAL64"], ["SampleTime[ms]", "1", "SampleTime[ms]", "1"]]
    rows += [["Port", "851", "Port", "851"], ["Unit", "deg", "Unit", "(None)"], []]
    for k, time in enumerate(FAST):
        row = [f"{time:g}", f"{position(time):.6f}"]
        if k < len(second):
            row += [f"{second[k]:g}", f"{current(second[k]):.6f}"]
        rows.append([cell.replace(".", decimal) for cell in row])
    return "\r\n".join(sign.join(row) for row in [*rows, ["EOF"]])


def test_a_header_that_is_damaged_is_no_traceback(tmp_path):
    text = pairs("\t", ",", FAST).replace("Name\tAxis1.ActPos\tName\tAxis1.ActCurr", "Nam\x02")
    (tmp_path / "scope.csv").write_text(text)
    with pytest.raises(InputError):
        measure(
            read_foreign(tmp_path / "scope.csv"),
            ColumnMap(("Axis1.ActPos",), ("Axis1.ActCurr",), "time"),
            [False],
        )


def grouped():
    """Several channels behind one time column, names only."""
    rows = [["Name", "Axis1.ActPos", "Axis1.ActCurr", "Name", "Axis1.Temp"]]
    rows += [[f"{t:g}", f"{position(t):.6f}", f"{current(t):.6f}", f"{t:g}", "25.5"] for t in FAST]
    return "\n".join(",".join(row) for row in rows)


@pytest.mark.parametrize(
    ("text", "exact"),
    [
        (pairs("\t", ",", FAST), True),
        (pairs(";", ",", FAST), True),
        (pairs(",", ".", FAST), True),
        (pairs("\t", ",", SLOW), False),
        (grouped(), True),
    ],
)
def test_channels_come_on_one_clock(tmp_path, text, exact):
    (tmp_path / "scope.csv").write_text(text, newline="")
    table = read_foreign(tmp_path / "scope.csv")
    assert table.time == "time"
    found = measure(table, ColumnMap(("Axis1.ActPos",), ("Axis1.ActCurr",), "time"), [False])
    milliseconds = found.time * 1000
    assert len(milliseconds) == (400 if exact else 399)
    np.testing.assert_allclose(milliseconds, FAST[: len(milliseconds)], atol=1e-9)
    unit = np.deg2rad(1) if "deg" in text else 1.0
    np.testing.assert_allclose(found.position[:, 0], unit * position(milliseconds), atol=1e-9)
    np.testing.assert_allclose(found.command[:, 0], current(milliseconds), atol=1e-12 if exact else 1e-5)
    assert any("TwinCAT" in words for words in found.remarks)
