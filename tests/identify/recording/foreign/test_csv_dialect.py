"""Tables in text of any dialect are read as what was written, or refused in one line."""

import dataclasses
import importlib.util
import itertools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.recording import InputError
from identify.recording.foreign import ColumnMap, CsvOptions, measure, read_foreign

spec = importlib.util.spec_from_file_location("dialects", Path(__file__).with_name("dialects.py"))
dialects = importlib.util.module_from_spec(spec)
import sys  # noqa: E402

sys.modules["dialects"] = dialects
spec.loader.exec_module(dialects)
Dialect, Measured, written = dialects.Dialect, dialects.Measured, dialects.written


def check(path, dialect, measured):
    """Read a file back and compare it with what was written."""
    path.write_bytes(written(measured, dialect))
    table = read_foreign(path, CsvOptions())
    if dialect.header:
        wanted = ("Zeit", "Achse.Position", "Zähler")
    else:
        wanted = ("1", "2", "4")
    strom = table.columns[2].name
    stated = dialect.units_row or (dialect.units_in_names and dialect.header)
    columns = ColumnMap(
        position=(wanted[1],),
        command=(strom,),
        time=wanted[0],
        time_unit=None if stated or dialect.time_form not in ("ms", "us", "ns") else dialect.time_form,
        position_unit=() if stated else ("deg",),
        command_unit=() if stated else ("mA",),
        extra=(wanted[2],),
    )
    found = measure(table, columns, [False])
    rounding = 1e-3 if dialect.time_form == "epoch ms" else 3e-7
    np.testing.assert_allclose(found.time - found.time[0], measured.time, rtol=0, atol=rounding)
    np.testing.assert_allclose(found.position[:, 0], np.deg2rad(measured.angle), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.command[:, 0], measured.current / 1000, rtol=1e-12, atol=1e-12)
    (extra,) = found.extra.values()
    np.testing.assert_array_equal(extra, measured.counter)
    assert found.remarks


CORPUS = [
    Dialect(
        separator=separator,
        decimal=decimal,
        encoding=encoding,
        line_end=end,
        quoted=decimal == "," and separator == ",",
    )
    for separator, decimal, (encoding, end) in itertools.product(
        (",", ";", "\t", "|", " "),
        (".", ","),
        (("utf-8", "\n"), ("utf-8-sig", "\r\n"), ("utf-16", "\r\n"), ("cp1252", "\r")),
    )
]
CORPUS += [
    dataclasses.replace(base, time_form=form)
    for base in (Dialect(), Dialect(separator=";", decimal=","), Dialect(separator="\t", encoding="cp1252"))
    for form in dialects.TIME_FORMS[1:]
]
CORPUS += [
    dataclasses.replace(base, **changes)
    for base in (Dialect(), Dialect(separator=";", decimal=","), Dialect(separator="\t", decimal=","))
    for changes in (
        {"preamble": 2, "blank_after_preamble": True},
        {"preamble": 12, "comment": "#"},
        {"units_row": True},
        {"units_row": True, "preamble": 1, "time_form": "ms"},
        {"units_in_names": True, "time_form": "ms"},
        {"comment": "%"},
        {"trailing_separator": True},
        {"header": False},
        {"header": False, "preamble": 1},
        {"final_line_end": False},
        {"quoted": True},
    )
    if base.separator != "," or base.decimal != ","
]
CORPUS += [
    Dialect(separator=";", decimal=",", thousands="."),
    Dialect(separator=";", thousands=","),
    Dialect(separator="\t", decimal=",", thousands="\u00a0"),
    Dialect(separator=";", thousands="'"),
]


@pytest.mark.parametrize("number", range(len(CORPUS)))
def test_each_dialect_of_the_corpus_is_read_as_it_was_written(tmp_path, number):
    check(tmp_path / "log.csv", CORPUS[number], Measured.of(120))


def test_the_corpus_holds_many_dialects():
    assert len(set(CORPUS)) == len(CORPUS) >= 60


any_dialect = st.builds(
    Dialect,
    separator=st.sampled_from((",", ";", "\t", "|", " ")),
    decimal=st.sampled_from((".", ",")),
    encoding=st.sampled_from(dialects.ENCODINGS),
    line_end=st.sampled_from(("\n", "\r\n", "\r")),
    quoted=st.booleans(),
    preamble=st.integers(0, 9),
    blank_after_preamble=st.booleans(),
    units_row=st.booleans(),
    units_in_names=st.booleans(),
    comment=st.sampled_from(("", "#", "%", "//")),
    trailing_separator=st.booleans(),
    time_form=st.sampled_from(dialects.TIME_FORMS),
    header=st.booleans(),
    final_line_end=st.booleans(),
)


@settings(max_examples=60, deadline=None)
@given(
    dialect=any_dialect.filter(lambda dialect: dialect.readable),
    rows=st.integers(20, 200),
    offset=st.floats(0, 6),
)
def test_a_table_in_any_dialect_is_read_as_it_was_written(tmp_path_factory, dialect, rows, offset):
    if dialect.units_row and not dialect.header:
        dialect = dataclasses.replace(dialect, units_row=False)
    if dialect.separator == " ":
        dialect = dataclasses.replace(dialect, trailing_separator=False, units_in_names=False)
    check(tmp_path_factory.mktemp("any") / "log.csv", dialect, Measured.of(rows, offset))


def test_commas_for_columns_and_decimals_are_refused_with_the_remedy(tmp_path):
    (tmp_path / "log.csv").write_bytes(written(Measured.of(50), Dialect(decimal=",")))
    with pytest.raises(InputError, match=r"cannot be told apart: export it with ';'"):
        read_foreign(tmp_path / "log.csv")
