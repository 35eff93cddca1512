"""The dialect of a table in text: separator, quotes, comments, header line, row of units, told by the cells."""

from __future__ import annotations

import csv
import itertools
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from identify.recording.errors import InputError
from identify.recording.foreign.cells import is_empty, is_number, is_typed, with_unit
from identify.recording.foreign.header_rows import is_types, is_units, labelled_header, trimmed
from identify.recording.foreign.text_file import TextFile
from identify.recording.foreign.twincat import is_scope_header, scope_names

SEPARATORS = (";", "\t", ",", "|", " ")
"""Candidates, the likelier first where two explain the cells equally; ' ' stands for any run of blanks."""
SEPARATOR_NAMES = {
    "comma": ",",
    "semicolon": ";",
    "tab": "\t",
    "\\t": "\t",
    "pipe": "|",
    "space": " ",
    "spaces": " ",
    "blank": " ",
}
COMMENTS = ("#", "%", "//", "!")
BLANKS_EXPLAIN_LESS = 0.95
"""Runs of blanks part cells at tabs too, and leave out cells that are empty: another sign that explains as much is meant."""
END_OF_HEADER = "***End_of_Header***"
"""LabVIEW's line between its settings, which are rows of numbers too, and the names."""
TYPED_SHARE = 0.8
"""Of its cells: a column of samples, or a row of them."""
RULE = re.compile(r":?[-=_+]{2,}:?")
"""A line drawn between the names and the samples."""
_ACROSS = 8
"""times as many columns as rows, and no header: no record of a robot is so"""


@dataclass(frozen=True)
class CsvOptions:
    """What a user states about a table in text; None: told by its cells."""

    header_line: int | None = None
    """Line of the names, from 1; 0: there is none."""
    separator: str | None = None
    decimal: str | None = None

    def __post_init__(self) -> None:
        if self.header_line is not None and self.header_line < 0:
            raise InputError(
                f"--header-line: {self.header_line}; give the line's number from 1, or 0 for none"
            )
        if self.separator is not None and len(SEPARATOR_NAMES.get(self.separator, self.separator)) != 1:
            raise InputError(
                f"--separator: '{self.separator}' is not one character; give the character, or {', '.join(SEPARATOR_NAMES)}"
            )
        if self.decimal not in (None, ".", ",", "point", "comma"):
            raise InputError(f"--decimal: '{self.decimal}' is not known; give '.' or ','")


@dataclass
class Dialect:
    """How the lines of a file make a table."""

    separator: str
    quote: str
    header_line: int
    """From 1; 0: there is none."""
    first_line: int
    """The first line that may hold samples, from 1."""
    names: list[str]
    width: int
    units: list[str] = field(default_factory=list)
    """A row of units, "" where a column has none; empty if there is no such row."""
    passed: list[str] = field(default_factory=list)
    """What was passed over, in words."""
    scope: bool = False
    """Whether it is an export of TwinCAT Scope."""

    def rows(self, lines: Iterable[str]) -> Iterator[list[str]]:
        """Lines as cells without blanks around them."""
        return split(lines, self.separator, self.quote)


def split(lines: Iterable[str], separator: str, quote: str) -> Iterator[list[str]]:
    """Lines as cells without blanks around them.

    Raises csv.Error: a quote is left open over far too many lines.
    """
    if separator == " ":
        plain = quote
        for line in lines:
            yield [cell.strip(plain) for cell in line.split()]
        return
    for row in csv.reader(lines, delimiter=separator, quotechar=quote, skipinitialspace=separator != "\t"):
        yield [cell.strip() for cell in row]


def split_line(line: str, separator: str, quote: str) -> list[str]:
    """The cells of one line by itself; a line that is one cell longer than csv takes is not separated by this sign."""
    try:
        return next(split([line], separator, quote), [])
    except csv.Error:
        return [line.strip()]


def is_comment(line: str) -> bool:
    """Whether a line is a remark or blank, not a row."""
    start = line.lstrip().lstrip('"')
    return not start or start.startswith(COMMENTS)


def uncommented(line: str) -> str:
    """A line without the sign of a comment at its begin."""
    text = line.strip()
    for sign in COMMENTS:
        if text.startswith(sign):
            return text.removeprefix(sign).lstrip("#%").strip()
    return line


def choose_dialect(text: TextFile, options: CsvOptions) -> Dialect:
    """Tell the dialect of a file from its first and last lines.

    Raises InputError: nothing in it looks like rows of samples, or the header does not fit them.
    """
    stated = options.separator
    head = list(text.head)
    if head and head[0].lower().startswith("sep=") and len(head[0]) >= 5:
        stated = stated or head[0][4]
        head[0] = ""
    ended = max((place for place, line in enumerate(head, 1) if line.startswith(END_OF_HEADER)), default=0)
    head[:ended] = [""] * ended
    body = [line for line in (*head, *text.tail) if not is_comment(line)]
    if not body:
        raise InputError(f"{text.path}: is empty")
    quote = _quote(body)
    wanted = (SEPARATOR_NAMES.get(stated, stated),) if stated else SEPARATORS
    best = max(
        (_Reading.of(body, separator, quote) for separator in wanted), key=lambda reading: reading.score
    )
    if best.rows_of_samples == 0:
        raise InputError(
            f"{text.path}: no rows of numbers are found; "
            + (
                "is this JSON? Export it as CSV, one row a sample"
                if body[0].lstrip()[:1] in "{["
                else "give --separator, and --header-line if the samples begin late"
            )
        )
    if best.lies_across:
        raise InputError(
            f"{text.path}: has {best.rows_of_samples} rows of {best.width} cells, each with a word first: samples run across;"
            " turn the table (transpose it), so that each row is a sample"
        )
    return _with_header(text, head, best, options)


@dataclass(frozen=True)
class _Reading:
    """What a separator makes of the lines."""

    separator: str
    quote: str
    width: int
    rows_of_samples: int
    numeric: tuple[bool, ...]
    """(width,) whether a column holds samples (and not words)."""
    empty: tuple[bool, ...]
    """(width,) whether a column has hardly a cell with anything in it."""
    score: float

    @classmethod
    def of(cls, lines: list[str], separator: str, quote: str) -> _Reading:
        rows = [split_line(line, separator, quote) for line in lines]
        shares = [_typed_share(row) for row in rows]
        candidates = [(row, share) for row, share in zip(rows, shares, strict=True) if share >= 0.5]
        if not candidates:
            return cls(separator, quote, 0, 0, (), (), 0.0)
        widths = Counter(len(row) for row, _share in candidates)
        width, count = max(widths.items(), key=lambda item: (item[1], item[0]))
        samples = [(row, share) for row, share in candidates if len(row) == width]
        columns = [
            [cell for cell in cells if cell] for cells in zip(*(row for row, _ in samples), strict=True)
        ]
        numeric = tuple(not cells or _share_of(cells) >= TYPED_SHARE for cells in columns)
        score = sum(share for _row, share in samples) * (1.0 if width > 1 else 0.25)
        if separator == " ":
            score *= BLANKS_EXPLAIN_LESS
        empty = tuple(len(cells) < (1 - TYPED_SHARE) * len(samples) for cells in columns)
        return cls(separator, quote, width, count, numeric, empty, score)

    def is_labelled(self, row: list[str]) -> bool:
        """Whether a word stands where samples have nothing."""
        return any(empty and not is_typed(cell) for cell, empty in zip(row, self.empty, strict=False))

    @property
    def lies_across(self) -> bool:
        """Whether rows are signals, each behind its name, and columns samples."""
        return self.width > _ACROSS * max(self.rows_of_samples, 4) and not self.numeric[0]

    def is_sample(self, row: list[str]) -> bool:
        """Whether cells are a row of samples: something in each column that is a number elsewhere, or nothing."""
        if abs(len(row) - self.width) > 1 or (len(row) > self.width and row[-1]):
            return False
        judged = [cell for cell, numeric in zip(row, self.numeric, strict=False) if numeric]
        return any(not is_empty(cell) for cell in judged) and all(is_typed(cell) for cell in judged)


def _typed_share(row: list[str]) -> float:
    filled = [cell for cell in row if cell]
    if not any(is_number(cell) or with_unit(cell) is not None for cell in filled):
        return 0.0
    return _share_of(filled)


def _share_of(filled: list[str]) -> float:
    """The share of cells that samples are made of."""
    return sum(map(is_typed, filled)) / len(filled)


def _quote(lines: list[str]) -> str:
    starts = Counter(line.lstrip()[:1] for line in lines)
    return "'" if starts["'"] > len(lines) // 2 else '"'


def _with_header(text: TextFile, head: list[str], reading: _Reading, options: CsvOptions) -> Dialect:
    head = _names_on_one_line(head, reading)
    cells = [split_line(line, reading.separator, reading.quote) for line in head]
    start = options.header_line or 0
    samples = [
        number
        for number, row in enumerate(cells[start:], start=start + 1)
        if not is_comment(head[number - 1]) and reading.is_sample(row)
    ]
    rows = [number for number in range(start + 1, len(head) + 1) if not is_comment(head[number - 1])]
    follows = dict(itertools.pairwise(rows))
    # A row of a header may hold numbers behind a word where samples have nothing; then words follow.
    first = next(
        (
            number
            for number in samples
            if not reading.is_labelled(cells[number - 1]) or follows.get(number, number) in samples
        ),
        samples[0] if samples else None,
    )
    if first is None:
        raise InputError(
            f"{text.path}: no row of samples is found below line {start}; is --header-line right?"
            if start
            else f"{text.path}: no row of samples is found in the first {len(head)} lines; give --header-line"
        )
    passed: list[str] = []
    above = [
        row for number, row in enumerate(cells[: first - 1], start=1) if not is_comment(head[number - 1])
    ]
    if options.header_line is None and is_scope_header(above, reading.width):
        names, units = scope_names(above, reading.width)
        passed.append("an export of TwinCAT Scope: times in ms before each group of channels")
        return Dialect(
            reading.separator, reading.quote, 0, first, names, reading.width, units, passed, scope=True
        )
    labelled = labelled_header(
        cells[: first - 1], [row for row in cells[first - 1 :] if reading.is_sample(row)], reading.width
    )
    if options.header_line is None and labelled is not None:
        place, names, units = labelled
        passed.append("rows above the samples are labelled by their first cell")
        return Dialect(
            reading.separator, reading.quote, place + 1, first, names, reading.width, units, passed
        )
    if options.header_line is not None:
        if options.header_line == 0:
            names, header, units = _numbered(reading.width), 0, []
        else:
            if options.header_line > len(head):
                raise InputError(
                    f"{text.path}: has no line {options.header_line} that could name the columns"
                )
            header = options.header_line
            names = trimmed(_row(head[header - 1], reading))
            between = [_row(head[n - 1], reading) for n in range(header + 1, first) if head[n - 1].strip()]
            units = next((row for row in between if is_units(row)), [])
    else:
        header, names, units = _search_header(text, head, first, reading, passed)
    if len(names) == reading.width - 1 and len(cells[first - 1]) == reading.width and header:
        last_empty = all(not row[-1] for row in cells[first - 1 :] if len(row) == reading.width)
        if not last_empty:
            names = ["", *names]
            passed.append("the first column has no name: taken as numbers of rows")
    if header and not 0 <= len(names) - (reading.width if reading.width > 1 else len(names)) <= 1:
        names = _fitting(text, names, header, reading, cells[first - 1])
    for number in range(header + 1, first) if header else ():
        row = _row(head[number - 1], reading)
        if (
            head[number - 1].strip()
            and not is_comment(head[number - 1])
            and row != units
            and not is_types(row)
        ):
            passed.append(f"line {number}, between the names and the samples, passed over")
    before = [n for n in range(1, header or first) if head[n - 1].strip()]
    if before:
        passed.append(
            f"{_lines(len(before))} above the header passed over"
            if header
            else f"{_lines(len(before))} passed over"
        )
    return Dialect(reading.separator, reading.quote, header, first, names, reading.width, units, passed)


def _names_on_one_line(head: list[str], reading: _Reading) -> list[str]:
    """Lines with names that are broken inside quotes, as of a spreadsheet, put on one line; the others stay where they are.

    Only above the samples: a quote left open there is a mistake.
    """
    lines = list(head)
    quote = reading.quote
    begun: int | None = None
    for place, line in enumerate(head):
        if reading.is_sample(split_line(line.replace(quote, ""), reading.separator, quote)):
            break
        if line.count(quote) % 2 == 0:
            continue
        if begun is None:
            begun = place
            continue
        lines[begun] = " ".join(head[begun : place + 1])
        lines[begun + 1 : place + 1] = [""] * (place - begun)
        begun = None
    return lines


def _search_header(
    text: TextFile, head: list[str], first: int, reading: _Reading, passed: list[str]
) -> tuple[int, list[str], list[str]]:
    """Line of the names (0: none), names, row of units: the nearest row of words above the samples that fits."""
    units: list[str] = []
    other: tuple[int, int] | None = None
    for number in range(first - 1, 0, -1):
        line = head[number - 1]
        if not line.strip():
            continue
        whole = _row(line, reading)
        row = trimmed(whole)
        if all(RULE.fullmatch(cell) for cell in row if cell):
            continue
        if len(whole) == reading.width and is_units(row) and _named_above(head, number, reading):
            row = whole  # units of some columns alone
        fits = len(row) in (reading.width, reading.width - 1) or _leaves_last_empty(row, reading, head, first)
        if not fits or (is_comment(line) and len(row) < _filled_width(reading, head, first)):
            if other is None and len(row) > 1 and not is_comment(line):
                other = (number, len(row))
            continue
        above = _named_above(head, number, reading)
        if above and is_types(row):
            passed.append(f"line {number}, data types, passed over")
            continue
        if above and not units and is_units(row):
            units = _row(line, reading)
            continue
        if len(row) < reading.width and not units and other is not None:
            continue
        written = [is_number(cell) for cell in row if cell]
        if all(written) or (above and any(written)):
            continue
        return number, row, units
    if other is not None:
        number, count = other
        both = "; separator and decimal are both ',', which cannot be told apart: export it with ';' between columns"
        raise InputError(
            f"{text.path} line {number}: has {count} cells, but the samples from line {first} on have {reading.width}"
            + (
                both
                if reading.separator == "," and 3 * reading.width >= 5 * count
                else "; say --header-line N (0: none) or --separator"
            )
        )
    return 0, _numbered(reading.width), units


def _filled_width(reading: _Reading, head: list[str], first: int) -> int:
    """Cells of the first sample without an empty one at its end, which a separator there makes."""
    sample = split_line(head[first - 1], reading.separator, reading.quote)
    return reading.width - (len(sample) == reading.width and not sample[-1])


def _leaves_last_empty(row: list[str], reading: _Reading, head: list[str], first: int) -> bool:
    return (
        len(row) == reading.width + 1
        and len(split_line(head[first - 1], reading.separator, reading.quote)) == reading.width
    )


def _named_above(head: list[str], number: int, reading: _Reading) -> bool:
    """Whether a row of words that fits stands above a line."""
    for line in reversed(head[: number - 1]):
        if not line.strip():
            continue
        row = trimmed(_row(line, reading))
        if abs(len(row) - reading.width) > 1 or reading.width == 1:
            return False
        return not all(is_number(cell) for cell in row if cell)
    return False


def _fitting(
    text: TextFile, names: list[str], header: int, reading: _Reading, sample: list[str]
) -> list[str]:
    if len(names) == reading.width - 1 and not sample[-1]:
        return names  # each row ends with a separator
    both = (
        "; separator and decimal are both ',', which cannot be told apart: export it with ';' between columns"
    )
    raise InputError(
        f"{text.path} line {header}: names {len(names)} columns, but the samples have {reading.width} cells"
        + (
            both
            if reading.separator == "," and 3 * reading.width >= 5 * len(names)
            else "; is --separator right?"
        )
    )


def _row(line: str, reading: _Reading) -> list[str]:
    plain = uncommented(line) if is_comment(line) else line
    return split_line(plain, reading.separator, reading.quote)


def _numbered(width: int) -> list[str]:
    return [str(index + 1) for index in range(width)]


def _lines(count: int) -> str:
    return "1 line" if count == 1 else f"{count} lines"
