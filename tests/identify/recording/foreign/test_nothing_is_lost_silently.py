"""What a damaged or badly exported table loses is refused with its line, or said."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.recording import InputError
from identify.recording.foreign import ColumnMap, CsvOptions, measure, read_foreign

TIME = np.arange(200) / 500
COLUMNS = ColumnMap(position=("q",), command=("i",), time="t")


def rows(time=TIME, form="{:.4f}"):
    """Lines of samples, without the header."""
    return [f"{form.format(t)},{np.sin(t):.6f},{np.cos(t):.6f}" for t in time]


def table(tmp_path, lines, header="t,q,i"):
    path = tmp_path / "log.csv"
    path.write_text("\n".join([header, *lines]) + "\n")
    return read_foreign(path, CsvOptions())


@pytest.mark.parametrize("closed_again", [False, True])
def test_an_open_quote_that_would_swallow_samples_is_refused_with_its_line(tmp_path, closed_again):
    lines = rows()
    lines[50] = lines[50].replace(",", ',"', 1)
    if closed_again:
        lines[120] = lines[120].replace(",", ',"', 1)
    with pytest.raises(InputError, match=r'line 52: a quote \("\) is opened and not closed.*line 53'):
        table(tmp_path, lines)


@given(
    place=st.integers(0, 198),
    column=st.integers(0, 2),
    separator=st.sampled_from([",", ";", "\t", "|"]),
)
@settings(max_examples=60, deadline=None)
def test_one_stray_quote_anywhere_loses_no_line_silently(tmp_path_factory, place, column, separator):
    """Either every sample is there, or a line is named in a refusal or in a remark."""
    lines = [line.replace(",", separator) for line in rows()]
    cells = lines[place].split(separator)
    cells[column] = '"' + cells[column]
    lines[place] = separator.join(cells)
    folder = tmp_path_factory.mktemp("quote")
    try:
        found = table(folder, lines, separator.join("tqi"))
        session = measure(found, COLUMNS, [False])
    except InputError as error:
        said = [str(error)]
    else:
        if len(session.time) == 200:
            return
        said = session.remarks
    assert any(f"line {place + 2}" in words for words in said)


def test_a_note_over_two_lines_is_kept_and_said(tmp_path):
    lines = [f"{line},ok" for line in rows()]
    lines[50] = lines[50].replace("ok", '"ok,\nbut loud"')
    found = table(tmp_path, lines, "t,q,i,note")
    assert len(found.column("q", "test")) == 200
    assert found.column("note", "test").words[50] == "ok,\nbut loud"
    assert "line 52: a cell goes over several lines, by its quotes" in found.remarks


@pytest.mark.parametrize("preamble", ["", 'recorded by "me"\n\n'])
def test_names_that_a_spreadsheet_broke_over_lines_keep_their_units(tmp_path, preamble):
    header = preamble + '"Time\n[ms]","Position\n[deg]","Motor\ncurrent\n[mA]"'
    lines = [f"{1000 * t:.4f},{10 * np.sin(t):.6f},{900 * np.cos(t):.6f}" for t in TIME]
    found = table(tmp_path, lines, header)
    columns = ColumnMap(("Position",), ("Motor current",), "Time")
    session = measure(found, columns, [False])
    np.testing.assert_allclose(session.time, TIME, atol=1e-9)
    np.testing.assert_allclose(session.position[:, 0], np.deg2rad(10 * np.sin(TIME)), atol=1e-6)
    np.testing.assert_allclose(session.command[:, 0], 0.9 * np.cos(TIME), atol=1e-6)


def test_a_last_line_that_was_cut_is_said_with_its_number(tmp_path):
    found = table(tmp_path, [*rows()[:-1], "0.3980,0.38"])
    assert len(found.column("q", "test")) == 199
    assert "line 201: cut off at the end of the file, left out" in found.remarks


def single_precision(seconds):
    return [f"{np.float32(each)}" for each in seconds]


def six_digits(seconds):
    return [f"{each:g}" for each in seconds]


@pytest.mark.parametrize("write", [single_precision, six_digits])
@pytest.mark.parametrize("repair", [None, "drop", "bridge"])
@pytest.mark.parametrize("epoch", [1_764_230_000.0, 1_764_230_000_000.0])
def test_an_epoch_without_its_last_digits_is_refused_once_whatever_the_repair(tmp_path, write, repair, epoch):
    stamps = write(epoch + TIME * (1000 if epoch > 1e12 else 1))
    lines = [",".join([stamp, *line.split(",")[1:]]) for stamp, line in zip(stamps, rows(), strict=True)]
    with pytest.raises(
        InputError, match=r"column 't': 200 samples have \d different times?: digits were lost.*--rate"
    ):
        measure(table(tmp_path, lines), COLUMNS, [False], repair)


def test_whole_seconds_are_refused_and_can_be_bridged(tmp_path):
    time = np.arange(400) / 20
    lines = [
        f"{1_764_230_000 + int(t)},{line.split(',', 1)[1]}" for t, line in zip(time, rows(time), strict=True)
    ]
    with pytest.raises(InputError, match=r"400 samples have 20 different times.*--repair bridge"):
        measure(table(tmp_path, lines), COLUMNS, [False])
    session = measure(table(tmp_path, lines), COLUMNS, [False], "bridge")
    np.testing.assert_allclose(session.time, time, atol=1e-9)


def test_a_clock_of_milliseconds_at_1500_hz_is_refused_as_before_and_bridged(tmp_path):
    """Fewer stamps repeat than do not: the ordinary refusal names line and remedy."""
    time = np.arange(400) / 1500
    lines = [
        f"{np.floor(t * 1000) / 1000:.3f},{line.split(',', 1)[1]}"
        for t, line in zip(time, rows(time), strict=True)
    ]
    with pytest.raises(InputError, match=r"line \d+: time does not increase.*--repair drop"):
        measure(table(tmp_path, lines), COLUMNS, [False])
    session = measure(table(tmp_path, lines), COLUMNS, [False], "bridge")
    np.testing.assert_allclose(session.time, time, atol=1.1e-3)
