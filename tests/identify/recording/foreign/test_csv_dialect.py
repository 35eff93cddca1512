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
from identify.recording.foreign.csv_dialect import choose_dialect, is_comment, uncommented
from identify.recording.foreign.text_file import open_text

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


def dialect_of(tmp_path, *lines, **options):
    """What is told of a file of these lines."""
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return choose_dialect(open_text(path), CsvOptions(**options))


SAMPLES = [f"{k},{0.5 * k},{k + 3}" for k in range(1, 9)]


@pytest.mark.parametrize(
    ("line", "remark"),
    [
        *((line, True) for line in ("# note", '"# note"', "  ", "", "//x", "!x", "%x")),
        *((line, False) for line in ("1,2", "a#b", "/x")),
    ],
)
def test_a_remark_begins_with_its_sign_or_is_blank(line, remark):
    assert is_comment(line) is remark


@pytest.mark.parametrize(
    ("line", "plain"),
    [
        ("# t,q", "t,q"),
        ("## t", "t"),
        ("// t", "t"),
        ("%% t", "t"),
        ("% %t", "%t"),
        ("t # q", "t # q"),
        (" t", " t"),
    ],
)
def test_the_sign_of_a_remark_is_taken_off_and_nothing_else(line, plain):
    assert uncommented(line) == plain


def test_names_units_and_the_first_line_of_samples(tmp_path):
    found = dialect_of(tmp_path, "t,q,i", "s,deg,mA", *SAMPLES)
    assert (found.header_line, found.first_line, found.width) == (1, 3, 3)
    assert found.names == ["t", "q", "i"]
    assert found.units == ["s", "deg", "mA"]
    assert found.passed == []
    assert (found.separator, found.quote, found.scope) == (",", '"', False)


def test_what_stands_above_the_header_is_passed_over_and_counted(tmp_path):
    found = dialect_of(tmp_path, "Recorder 3", "", "t,q,i", *SAMPLES)
    assert (found.header_line, found.first_line) == (3, 4)
    assert found.passed == ["1 line above the header passed over"]
    found = dialect_of(tmp_path, "Recorder 3", "serial 4", "t,q,i", *SAMPLES)
    assert found.passed == ["2 lines above the header passed over"]
    found = dialect_of(tmp_path, "Recorder", *SAMPLES)
    assert (found.header_line, found.names) == (0, ["1", "2", "3"])
    assert found.passed == ["1 line passed over"]


def test_the_header_in_a_remark_is_taken_where_it_fits(tmp_path):
    found = dialect_of(tmp_path, "# t,q,i", *SAMPLES)
    assert (found.header_line, found.names) == (1, ["t", "q", "i"])
    found = dialect_of(tmp_path, "# t,q", *SAMPLES)
    assert found.header_line == 0


def test_data_types_and_words_between_names_and_samples_are_passed_over(tmp_path):
    found = dialect_of(tmp_path, "t,q,i", "LREAL,DINT,uint16", *SAMPLES)
    assert (found.header_line, found.units) == (1, [])
    assert found.passed == ["line 2, data types, passed over"]
    found = dialect_of(tmp_path, "t,q,i", "(one),(two),(three)", *SAMPLES)
    assert found.units == ["(one)", "(two)", "(three)"]
    found = dialect_of(tmp_path, "t,q,i", "one,two,three", *SAMPLES)
    assert (found.header_line, found.names) == (2, ["one", "two", "three"])


def test_half_of_a_row_of_units_must_be_known(tmp_path):
    assert dialect_of(tmp_path, "t,q,i", "s,deg,what", *SAMPLES).units == ["s", "deg", "what"]
    assert dialect_of(tmp_path, "t,q,i", "s,how,what", *SAMPLES).names == ["s", "how", "what"]
    assert dialect_of(tmp_path, "t,q,i", "s,-,what", *SAMPLES).units == ["s", "-", "what"]


def test_a_stated_header_line_is_the_header(tmp_path):
    lines = ["a,b,c", "t,q,i", "s,deg,A", *SAMPLES]
    found = dialect_of(tmp_path, *lines, header_line=1)
    assert (found.header_line, found.names, found.first_line) == (1, ["a", "b", "c"], 4)
    assert found.units == ["s", "deg", "A"]
    assert found.passed == ["line 2, between the names and the samples, passed over"]
    none = dialect_of(tmp_path, *lines, header_line=0)
    assert (none.header_line, none.names) == (0, ["1", "2", "3"])
    assert none.passed == ["3 lines passed over"]
    with pytest.raises(InputError, match="no row of samples is found below line 11; is --header-line right"):
        dialect_of(tmp_path, *lines, header_line=11)


def test_a_first_column_without_a_name_and_a_last_one_without_cells(tmp_path):
    found = dialect_of(tmp_path, "q,i", *SAMPLES)
    assert found.names == ["", "q", "i"]
    assert found.passed == ["the first column has no name: taken as numbers of rows"]
    found = dialect_of(tmp_path, "t,q,i", *[f"{row}," for row in SAMPLES])
    assert (found.names, found.width) == (["t", "q", "i"], 4)
    assert found.passed == []


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ("t,q,i,x,y", "names 5 columns, but the samples have 3 cells; is --separator right"),
        # three cells for one name: as decimal commas between commas would make of it
        ("t", "names 1 columns, but the samples have 3 cells; separator and decimal are both ','"),
    ],
)
def test_names_that_do_not_fit_the_samples_are_refused(tmp_path, names, words):
    with pytest.raises(InputError, match=words):
        dialect_of(tmp_path, names, *SAMPLES, header_line=1)


def test_names_of_another_number_of_cells_ask_for_the_header_line(tmp_path):
    with pytest.raises(InputError, match=r"line 1: has 5 cells, but the samples from line 2 on have 3"):
        dialect_of(tmp_path, "t,q,i,x,y", *SAMPLES)
    with pytest.raises(InputError, match=r"line 1: has 2 cells.*have 4; separator and decimal are both ','"):
        dialect_of(tmp_path, "t,q", *[f"{k},5,{k},25" for k in range(1, 9)])


@pytest.mark.parametrize("sign", [";", "\t", ",", "|"])
def test_a_first_line_may_state_the_separator(tmp_path, sign):
    found = dialect_of(tmp_path, f"sep={sign}", *[line.replace(",", sign) for line in ("t,q,i", *SAMPLES)])
    assert (found.separator, found.header_line, found.names) == (sign, 2, ["t", "q", "i"])


def test_a_stated_separator_goes_before_that_of_the_file(tmp_path):
    found = dialect_of(tmp_path, "sep=;", "t,q,i", *SAMPLES, separator="comma")
    assert found.separator == ","


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"header_line": -1}, "--header-line: -1; give the line's number from 1, or 0 for none"),
        ({"separator": "::"}, "--separator: '::' is not one character"),
        ({"separator": ""}, "--separator: '' is not one character"),
        ({"decimal": ";"}, "--decimal: ';' is not known; give '.' or ','"),
    ],
)
def test_options_that_say_nothing_are_refused(options, words):
    with pytest.raises(InputError) as refused:
        CsvOptions(**options)
    assert words in str(refused.value)
    CsvOptions(header_line=0, separator="tab", decimal="comma")


def test_empty_files_and_files_of_words_are_refused(tmp_path):
    with pytest.raises(InputError, match="is empty"):
        dialect_of(tmp_path, "# nothing", "")
    with pytest.raises(InputError, match="no rows of numbers are found; give --separator"):
        dialect_of(tmp_path, "a,b", "c,d")


def test_single_quotes_are_quotes_where_most_lines_begin_with_one(tmp_path):
    quoted = ["'t','q'", *[f"'{k}','{0.5 * k}'" for k in range(1, 9)]]
    assert dialect_of(tmp_path, *quoted).quote == "'"
    assert dialect_of(tmp_path, *quoted).names == ["t", "q"]
    assert dialect_of(tmp_path, "'t',q", *SAMPLES).quote == '"'


def test_names_broken_over_lines_inside_quotes_are_one_line(tmp_path):
    found = dialect_of(tmp_path, '"t', '[s]",q,"i', '[mA]"', *SAMPLES)
    assert found.names == ["t [s]", "q", "i [mA]"]
    assert (found.header_line, found.first_line) == (1, 4)


def test_blanks_separate_in_any_number(tmp_path):
    found = dialect_of(tmp_path, "t   q  i", *[f" {k}   {0.5 * k}  {k}" for k in range(1, 9)])
    assert (found.separator, found.names, found.width) == (" ", ["t", "q", "i"], 3)


def test_a_table_is_read_whose_line_is_one_cell_too_long_for_another_separator(tmp_path):
    """Other separators make one cell of 160 kB of it, which Python's csv refuses."""
    path = tmp_path / "wide.csv"
    names = ",".join(f"column {number} {'x' * 190}" for number in range(800))
    path.write_text("\n".join([names, *(",".join([f"0.{row}"] * 800) for row in range(3))]))
    assert len(read_foreign(path, CsvOptions()).columns) == 800
