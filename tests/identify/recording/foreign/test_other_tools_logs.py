"""Logs laid out as other people's tools write them: every sample is there, at its number, or one line says what helps."""

import gzip

import numpy as np
import pytest
from scipy.io import savemat

from identify.recording import InputError
from identify.recording.foreign import ColumnMap, measure, read_foreign

TIME = np.round(np.arange(60) * 0.002, 6)
ANGLE = np.round(0.8 * np.sin(2 * TIME + 0.3), 6)
CURRENT = np.round(3.1 * np.cos(9 * TIME), 5)
SAMPLES = list(zip(TIME, ANGLE, CURRENT, strict=True))


def lines(form, head=""):
    """A file of a head and one line for each sample, in which t, q, i stand for the numbers and k for the place."""
    body = [eval(f"f{form!r}", {"t": t, "q": q, "i": i, "k": k}) for k, (t, q, i) in enumerate(SAMPLES)]
    return head + "\n".join(body) + "\n"


def lvm(columns, names, form):
    """A LabVIEW measurement file; each row of it may lack the cell of the comment."""
    head = (
        "LabVIEW Measurement\t\nSeparator\tTab\nX_Columns\t"
        + columns
        + "\n***End_of_Header***\t\n\t\nChannels\t2\t\t\n"
    )
    return lines(form, f"{head}Delta_X\t0.002\t0.002\t\n***End_of_Header***\t\t\t\n{names}\tComment\n")


def oscilloscope_with_settings_beside():
    """As of Tektronix TDS: settings stand beside the first samples, in columns of their own, without a header."""
    settings = ["Record Length,60", "Sample Interval,0.002", "Source,CH1", "Vertical Units,V"]
    cells = [*settings, *[","] * (len(SAMPLES) - len(settings))]
    return "".join(f"{cells[k]},,{t:+.9f},{q:.6f},{i:.5f}\n" for k, (t, q, i) in enumerate(SAMPLES))


SCOPE = "Name,YT Scope Project\nFile,a.svdx\nStarttime of export,133238090039920000\n\nName,q,i\n\n"

CONTROLDESK = (
    'description,"Recording 1"\ncreated,2026-11-27T14:03:00\n\nplatform,DS1202\nid,,1,2\ntype,x,y,y\n'
    'path,,"Model Root/Plant/q","Model Root/i"\nunit,s,1,A\nname,time,q [1],i\ndevice,,DS1202,DS1202\n'
)

READ = {
    "LabVIEW, one time": (lvm("One", "X_Value\tq\ti", "{t:.6f}\t{q:.6f}\t{i:.6f}"), "X_Value", "q", "i"),
    "LabVIEW, times of each": (
        lvm("Multi", "X_Value\tq\tX_Value\ti", "{t:.6f}\t{q:.6f}\t{t:.6f}\t{i:.6f}"),
        "#1",
        "q",
        "i",
    ),
    "LabVIEW, no times": (lvm("No", "X_Value\tq\ti", "\t{q:.6f}\t{i:.6f}"), None, "q", "i"),
    "Tektronix TDS": (oscilloscope_with_settings_beside(), "#4", "#5", "#6"),
    "Rigol": (lines("{q:.6f},{i:.5f},", "CH1V,CH2V,t0 = 0s, tInc = 2e-3s\n"), None, "CH1V", "CH2V"),
    "PicoScope": (lines("{t*1000:.6f},{q},{i}", "Time,A,B\n(ms),(V),(A)\n\n"), "Time", "A", "B"),
    "units of some columns": (lines("{round(t*1000)},{q},{i}", "Tick,q,i (A)\n(ms),,\n"), "Tick", "q", "i"),
    "TwinCAT Scope, names alone": (lines("{round(t*1000)},{q},{i}", SCOPE), "time", "q", "i"),
    "pandas, spans of time": (lines("0 days 00:00:{t:09.6f},{q},{i}", ",q,i\n"), "#1", "q", "i"),
    "spans past midnight": (
        lines(
            "{k//30} days, {23 if k<30 else 0:02d}:{59 if k<30 else 0:02d}:{(59.94+t if k<30 else t-0.06):06.3f};{q};{i}",
            "t;q;i\n",
        ),
        "t",
        "q",
        "i",
    ),
    ".NET, spans of time": (lines("1.00:00:{t:010.7f};{q};{i}", "t;q;i\n"), "t", "q", "i"),
    "a header in a comment": (
        lines("{t} ; {q} ; {i} ;", "# recorder\n# t (s) ; q (rad) ; i (A)\n"),
        "t",
        "q",
        "i",
    ),
    "a table with a rule": (lines("|{t}|{q}|{i}|", "|t|q|i|\n|---|---|---|\n"), "t", "q", "i"),
    "units in each cell": (lines("{t} s,{q} rad,{i} A", "t,q,i\n"), "t", "q", "i"),
    "dSPACE ControlDesk": (
        lines("{'trace_values' if k==0 else ''},{t},{q},{i}", CONTROLDESK),
        "time",
        "q [1]",
        "i",
    ),
    "words at the end": (
        lines("{t},{q},{i}", "t,q,i\n") + "End of record,,\nSum,-,-\n",
        "t",
        "q",
        "i",
    ),
    "an abbreviated unit": (lines("{t},{q},{i}", "Time [Sec.],q [Rad],i [Amp.]\n"), "Time", "q", "i"),
}


@pytest.mark.parametrize("tool", READ)
def test_every_sample_is_read_at_its_number(tmp_path, tool):
    text, time, position, command = READ[tool]
    (tmp_path / "log.txt").write_text(text)
    rate = None if time else 500.0
    columns = ColumnMap((position,), (command,), time, rate, None, ("1",), ("1",))
    session = measure(read_foreign(tmp_path / "log.txt"), columns, [False])
    np.testing.assert_allclose(session.time - session.time[0], TIME, atol=1e-9)
    np.testing.assert_array_equal(session.position[:, 0], ANGLE)
    np.testing.assert_array_equal(session.command[:, 0], CURRENT)


@pytest.mark.parametrize("cell", ["1.#INF", "-1.#IND", "1.#QNAN00", "1.5abc", "∞", "0x12", "#DIV/0!"])
def test_a_cell_that_is_no_number_is_never_taken_for_one(tmp_path, cell):
    rows = lines("{t},{q if k!=20 else CELL},{i}".replace("CELL", repr(cell)), "t,q,i\n")
    (tmp_path / "log.csv").write_text(rows)
    with pytest.raises(InputError, match=r"column 'q', line 22: .*--repair drop"):
        measure(read_foreign(tmp_path / "log.csv"), ColumnMap(("q",), ("i",), "t"), [False])


@pytest.mark.parametrize(
    ("form", "unit", "remedy"),
    [
        ("{45258.5 + t / 86400:.12f},{q},{i}", None, "too short for a motion.*--time-unit.*d for days"),
        ("{k},{q},{i}", None, "if it numbers the samples, give --rate"),
        ("{t*1000:.1f},{q},{i}", None, "too long for a motion; give its --time-unit"),
        ("{45258.5 + t / 86400:.12f},{q},{i}", "d", ""),
    ],
)
def test_a_time_of_another_unit_is_refused_with_the_option_that_helps(tmp_path, form, unit, remedy):
    (tmp_path / "log.csv").write_text(lines(form, "t,q,i\n"))
    columns = ColumnMap(("q",), ("i",), "t", None, unit)
    if remedy:
        with pytest.raises(InputError, match=remedy):
            measure(read_foreign(tmp_path / "log.csv"), columns, [False])
    else:
        time = measure(read_foreign(tmp_path / "log.csv"), columns, [False]).time
        np.testing.assert_allclose(time - time[0], TIME, atol=1e-6)


def signals(fields, *values):
    """A MATLAB array of structs."""
    array = np.zeros((1, len(values)), dtype=[(name, "O") for name in fields])
    for place, value in enumerate(values):
        array[0, place] = value
    return array


def test_signals_of_scopes_and_of_controldesk_are_found_by_their_labels(tmp_path):
    scope = signals(("values", "dimensions", "label"), (ANGLE, 1, "q"), (CURRENT, 1, "i"), (CURRENT, 1, ""))
    data = signals(("Name", "Data", "Unit"), ("arm/q", np.degrees(ANGLE), "deg"), ("arm/i", CURRENT, ""))
    content = {"scope": {"time": TIME, "signals": scope}, "rec": {"X": {"Data": TIME}, "Y": data}}
    savemat(tmp_path / "log.mat", content)
    table = read_foreign(tmp_path / "log.mat")
    for time, position, command in (
        ("scope.time", "scope.signals.q.values", "scope.signals.i.values"),
        ("rec.X.Data", "rec.Y.arm/q.Data", "rec.Y.arm/i.Data"),
        ("scope.time", "scope.signals.q.values", "scope.signals.3.values"),
    ):
        session = measure(table, ColumnMap((position,), (command,), time), [False])
        np.testing.assert_allclose(session.position[:, 0], ANGLE, atol=1e-12)
        np.testing.assert_array_equal(session.command[:, 0], CURRENT)


def test_a_packed_file_that_is_no_text_and_an_empty_one_say_what_to_do(tmp_path):
    savemat(tmp_path / "log.mat", {"t": TIME})
    (tmp_path / "log.mat.gz").write_bytes(gzip.compress((tmp_path / "log.mat").read_bytes()))
    with pytest.raises(InputError, match=r"unpack it: gunzip log\.mat\.gz"):
        read_foreign(tmp_path / "log.mat.gz")
    (tmp_path / "log.mat").write_bytes(b"")
    with pytest.raises(InputError, match="is empty"):
        read_foreign(tmp_path / "log.mat")


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("t," + ",".join(map(str, TIME)) + "\nq," + ",".join(map(str, ANGLE)) + "\n", "turn the table"),
        (lines('{{"t": {t}, "q": {q}}}'), "is this JSON. Export it as CSV, one row a sample"),
    ],
)
def test_what_is_no_table_of_samples_is_refused_with_what_would_be_one(tmp_path, text, remedy):
    (tmp_path / "log.csv").write_text(text)
    with pytest.raises(InputError, match=remedy) as raised:
        read_foreign(tmp_path / "log.csv")
    assert "\n" not in str(raised.value)


def test_a_row_for_each_signal_is_bridged_to_the_rows_of_one(tmp_path):
    """As PlotJuggler exports signals that were sampled at different instants."""
    rows = lines("{t:.6f},{q},\n{t + 0.0001:.6f},,{i}", "__time,/js/position[0],/drive/current\n")
    (tmp_path / "log.csv").write_text(rows)
    columns = ColumnMap(("/js/position[0]",), ("/drive/current",), "__time")
    session = measure(read_foreign(tmp_path / "log.csv"), columns, [False], "bridge")
    np.testing.assert_array_equal(session.position[:, 0], ANGLE[1:])
    np.testing.assert_allclose(session.time - session.time[0], TIME[:-1], atol=1e-9)
    np.testing.assert_allclose(session.command[:, 0], np.interp(TIME[1:], TIME + 1e-4, CURRENT), atol=1e-9)
    assert not any("is no unit that is known" in remark for remark in session.remarks)
