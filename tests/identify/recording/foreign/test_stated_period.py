"""Files without times whose head says how far apart their samples are."""

import numpy as np
import pytest

from identify.recording import InputError
from identify.recording.foreign import ColumnMap, measure, read_foreign
from identify.recording.foreign.guesses import guess_roles
from identify.recording.foreign.stated_period import stated_period

ROWS = [f"{np.sin(k / 9):.6f}{{0}}{np.cos(k / 9):.6f}" for k in range(60)]


def body(separator=","):
    return "".join(row.format(separator) + "\n" for row in ROWS)


def numbered(end=""):
    return "".join(f"{k},{row.format(',')}{end}\n" for k, row in enumerate(ROWS))


LVM = "LabVIEW Measurement\nX_Dimension\tTime\tTime\nDelta_X\t{0}\t{0}\n***End_of_Header***\nX_Value\tq\ti\n"
LVM_BODY = "".join("\t" + row.format("\t").replace(".", ",") + "\n" for row in ROWS)
STATED = {
    "Rigol DS1000Z": (
        "X,q,i,Start,Increment,\nSequence,Volt,Volt,-1.5e-01,2.000000e-03\n" + numbered(",,"),
        0.002,
    ),
    "Rigol DS1054": ("q,i,t0 = -0.3s, tInc = 2e-3s\n" + body().replace("\n", ",,\n"), 0.002),
    "LabVIEW": (LVM.format("0,002") + LVM_BODY, 0.002),
    "Tektronix": ("Sample Interval,4.0E-3,4.0E-3\nRecord Length,60,60\n\nq,i\n" + body(), 0.004),
    "a rate": ("Abtastrate;2 kHz\nq;i\n" + body(";"), 0.0005),
    "a comment": ("# dt = 250 us\n# q, i\n" + body(), 0.00025),
    "EPOS recorder": ("Sampling Period [us]: 1000\nq\ti\n" + body("\t"), 0.001),
}


@pytest.mark.parametrize("tool", STATED)
def test_the_period_that_a_file_states_is_taken_and_said(tmp_path, tool):
    text, period = STATED[tool]
    (tmp_path / "log.txt").write_text(text)
    table = read_foreign(tmp_path / "log.txt")
    assert guess_roles(table).time is None
    session = measure(table, ColumnMap(("q",), ("i",), position_unit=("1",), command_unit=("1",)), [False])
    np.testing.assert_allclose(session.time, period * np.arange(60), rtol=1e-12)
    assert any(f"no time column: {period:g} s between samples" in remark for remark in session.remarks)


@pytest.mark.parametrize(
    "head",
    [
        "X_Dimension\tFrequency\nDelta_X\t0.5\nX_Value\tq\ti\n",
        "Delta_X\t0.002\t0.004\nX_Value\tq\ti\n",
        "dt 0.002\nq\ti\n",
        "Increment [deg]\t0.002\nq\ti\n",
        "Sample Interval\t0\nq\ti\n",
    ],
)
def test_what_is_no_time_or_contradicts_itself_is_not_taken(tmp_path, head):
    lines = head.splitlines()
    assert stated_period(lines, [line.split("\t") for line in lines], "\t") is None


def test_a_rate_that_is_given_overrules_and_none_at_all_is_asked_for(tmp_path):
    (tmp_path / "log.csv").write_text("Sample Interval,0.004\nq,i\n" + body())
    table = read_foreign(tmp_path / "log.csv")
    session = measure(table, ColumnMap(("q",), ("i",), rate=1000.0), [False])
    assert session.time[1] == 0.001
    (tmp_path / "log.csv").write_text("q,i\n" + body())
    with pytest.raises(InputError, match="give --time COLUMN, or --rate"):
        measure(read_foreign(tmp_path / "log.csv"), ColumnMap(("q",), ("i",)), [False])
