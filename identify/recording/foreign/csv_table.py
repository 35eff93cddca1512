"""A table in text, of any dialect, as named columns; what was decided is said."""

from __future__ import annotations

import csv
import gzip
import itertools
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.recording.errors import InputError
from identify.recording.foreign.cells import (
    Decimal,
    decimal_of,
    is_empty,
    is_number,
    is_typed,
    numbers,
    unit_in_cells,
)
from identify.recording.foreign.csv_dialect import (
    CsvOptions,
    Dialect,
    choose_dialect,
    is_comment,
    split_line,
)
from identify.recording.foreign.cut_line import is_cut
from identify.recording.foreign.instants import is_instant
from identify.recording.foreign.stated_period import StatedPeriod, stated_period
from identify.recording.foreign.table import ForeignColumn, ForeignTable
from identify.recording.foreign.text_file import LOOKED_AT, TextFile, open_text
from identify.recording.foreign.twincat import one_clock
from identify.recording.units import Unit, split_name, unit_of

ROWS = 1 << 15
"""Rows made into numbers at a time."""
SIGN_NAMES = {",": "','", ";": "';'", "\t": "tab", " ": "blanks", "|": "'|'"}


def read_csv(path: Path, options: CsvOptions) -> ForeignTable:
    """Read a table in text.

    Raises InputError: it cannot be read as one; says which option would help.
    """
    text = open_text(path)
    dialect = choose_dialect(text, options)
    reader = _Reader(text, dialect)
    try:
        table = reader.table(options)
        return one_clock(table) if dialect.scope else table
    except csv.Error as error:
        raise InputError(f"{path}: cannot be split into cells ({error}); is a quote left open?") from None
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"{path}: the gzip file is damaged or cut short ({error}); copy it again") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not text throughout; export it as CSV in UTF-8") from None


class _Reader:
    """Reads the rows of one file block by block."""

    def __init__(self, text: TextFile, dialect: Dialect) -> None:
        self.text = text
        self.dialect = dialect
        self.width = max(len(dialect.names), dialect.width)
        self.names = dialect.names + [""] * (self.width - len(dialect.names))
        self.line = 0
        self.remarked = 0
        self.row_began = 0
        """Line at which the row that is being read begins; 0 between rows."""
        self.over_lines: list[int] = []
        """Lines at which rows with a line break inside quotes begin."""
        self.not_rows: list[int] = []
        self.cut_short: list[int] = []
        """Lines at the end of the file that hold fewer cells than there are columns, or a cell that was cut."""
        self._cells_above: list[list[str]] = []
        self._decimal_signs: list[Decimal] = []
        self.wrong_rows: dict[int, str] = {}

    def table(self, options: CsvOptions) -> ForeignTable:
        """All columns."""
        sample = self._sample()
        decimals, decimal_remark = self._decimals(sample, options.decimal)
        self._cells_above = sample[-LOOKED_AT:-1]
        self._decimal_signs = decimals
        word = [self._holds_words(column) for column in zip(*sample, strict=True)] if sample else []
        word += [True] * (self.width - len(word))
        parts: list[list[Any]] = [[] for _name in self.names]
        wrong: list[dict[int, str]] = [{} for _name in self.names]
        lines: list[NDArray[np.int64]] = []
        rows_before = 0
        for rows, numbers_of_lines in self._blocks():
            lines.append(np.array(numbers_of_lines, dtype=np.int64))
            for place, cells in enumerate(zip(*rows, strict=True)):
                if word[place]:
                    parts[place].append(cells)
                    continue
                values, faults = numbers(cells, decimals[place])
                parts[place].append(values)
                wrong[place] |= {rows_before + index: cells[index] for index in faults[:1000]}
            rows_before += len(rows)
        if not rows_before:
            raise InputError(f"{self.text.path}: holds a header and no samples")
        columns = [
            self._column(place, parts[place], word[place], wrong[place], sample)
            for place in range(self.width)
            if self.names[place] or not _all_empty(parts[place])
        ]
        if all(column.numbers is None for column in columns):
            raise InputError(f"{self.text.path}: holds no column of numbers")
        remarks = self._remarks(decimals, word, decimal_remark)
        period = self._period()
        return ForeignTable(
            self.text.path, tuple(columns), {}, tuple(remarks), np.concatenate(lines), period=period
        )

    def _period(self) -> StatedPeriod | None:
        head = self.text.head[: self.dialect.first_line - 1]
        rows = [split_line(line, self.dialect.separator, self.dialect.quote) for line in head]
        return stated_period(head, rows, self.dialect.separator)

    def _blocks(self) -> Iterator[tuple[list[list[str]], list[int]]]:
        rows: list[list[str]] = []
        numbers_of_lines: list[int] = []
        total = 0
        for row in self.dialect.rows(self._body()):
            if self.row_began and self.row_began < self.line:
                self.over_lines.append(self.row_began)
            self.row_began = 0
            fitted = self._fitted(row, total)
            if fitted is not None and self._is_cut(row):
                self.cut_short.append(self.line)
                continue
            if fitted is None:
                continue
            rows.append(fitted)
            numbers_of_lines.append(self.line)
            total += 1
            if len(rows) == ROWS:
                yield rows, numbers_of_lines
                rows, numbers_of_lines = [], []
        if rows:
            yield rows, numbers_of_lines

    def _body(self) -> Iterator[str]:
        for number, line in enumerate(self.text.lines(), start=1):
            self.line = number
            if number < self.dialect.first_line:
                continue
            if is_comment(line):
                self.remarked += bool(line.strip())
                continue
            if self.row_began:
                self._refuse_swallowed(line)
            else:
                self.row_began = number
            yield f"{line}\n"

    def _refuse_swallowed(self, line: str) -> None:
        """Refuse a line that reads as samples by itself and would vanish in a cell of the row before.

        A quote that is opened and not closed takes all that follows, up to the next quote, into one cell.
        """
        cells = [cell.strip(f"{self.dialect.quote} ") for cell in line.split(self.dialect.separator)]
        typed = sum(is_typed(cell) and not is_empty(cell) for cell in cells)
        if len(cells) >= self.width and 2 * typed >= len(cells):
            raise InputError(
                f"{self.text.path} line {self.row_began}: a quote ({self.dialect.quote}) is opened and not closed, so"
                f" the samples from line {self.line} on would be lost in one cell; close or remove the quote"
            )

    def _fitted(self, row: list[str], index: int) -> list[str] | None:
        """A row of as many cells as there are columns; None for a line that is no row of samples."""
        if len(row) == self.width and not (row[0] and row[0] == self.names[0]):
            if is_number(row[0]) or not row[0] or any(is_typed(cell) and not is_empty(cell) for cell in row):
                return row
            self.not_rows.append(self.line)
            return None
        if len(row) > self.width and not any(row[self.width :]):
            return row[: self.width]
        if self.dialect.width <= len(row) < self.width and row != self.names[: len(row)]:
            return row + [""] * (self.width - len(row))  # names of more columns than any sample has
        if len(row) == self.width - 1 == self.dialect.width - 1 and not self.names[-1]:
            return [*row, ""]
        at_end = self.line >= self.text.count - 3
        typed = sum(is_typed(cell) and not is_empty(cell) for cell in row)
        if row[: self.width] == self.names or 2 * typed < len(row) or not row:
            self.not_rows.append(self.line)
            return None
        if at_end and len(row) < self.width and not self.dialect.scope:
            self.cut_short.append(self.line)
            return None
        if len(row) > self.width:
            raise InputError(
                f"{self.text.path} line {self.line}: {len(row)} cells, but there are {self.width} columns;"
                " mend the line, or give --separator"
            )
        self.wrong_rows[index] = f"{len(row)} cells instead of {self.width}"
        return row + [""] * (self.width - len(row))

    def _is_cut(self, row: list[str]) -> bool:
        """Whether a row is the last one, not ended, and was cut inside its last cell."""
        if self.line < self.text.count or self.text.ended:
            return False
        place = min(len(row), self.width) - 1
        if not row[place] and not any(cells[place] for cells in self._cells_above):
            return False  # each line ends with a separator, and so does this one
        above = [cells[place] for cells in self._cells_above]
        return is_cut(row[place], above, self._decimal_signs[place])

    def _sample(self) -> list[list[str]]:
        lines = self.text.head[self.dialect.first_line - 1 :] + self.text.tail
        rows = [
            split_line(line, self.dialect.separator, self.dialect.quote)
            for line in lines
            if not is_comment(line)
        ]
        fitted = [(row + [""] * self.width)[: self.width] for row in rows]
        return [row for row in fitted if sum(map(is_typed, row)) * 2 >= len(row)] or fitted

    def _holds_words(self, cells: tuple[str, ...]) -> bool:
        filled = [cell for cell in cells if not is_empty(cell)]
        timed = sum(is_instant(cell) and not is_number(cell) for cell in filled)
        typed = sum(map(is_typed, filled)) - timed
        return 2 * timed >= max(len(filled), 1) or 2 * typed < len(filled)

    def _decimals(self, sample: list[list[str]], stated: str | None) -> tuple[list[Decimal], str]:
        """The decimal sign of each column, and what is to be said about it."""
        if stated is not None:
            sign: Decimal = "," if stated in (",", "comma") else "."
            return [sign] * self.width, f"decimal sign '{sign}' as given"
        by_column = [
            decimal_of(cell for cell in cells if not is_instant(cell)) for cells in zip(*sample, strict=True)
        ] or [(None, False)] * self.width
        sure = [sign for sign, certain in by_column if certain]
        commas, points = sure.count(","), sure.count(".")
        common: Decimal = "," if commas > points else "."
        decimals: list[Decimal] = []
        doubted = []
        for place, (shown, certain) in enumerate(by_column):
            if shown is None:
                decimals.append(common)
            elif certain or (sure and shown == common):
                decimals.append(shown)
            elif sure:
                decimals.append(common)  # the other sign separates thousands
            else:
                decimals.append(shown)
                doubted += [place] if shown == "," else []
        if doubted:
            return (
                decimals,
                f"'1,234' is read as 1.234 in column {doubted[0] + 1}; if it means 1234, say --decimal .",
            )
        mixed = set(sure)
        if mixed == {",", "."}:
            return decimals, "decimal comma in some columns, decimal point in others, by their cells"
        return decimals, "decimal comma" if "," in mixed else ""

    def _column(
        self, place: int, parts: list[Any], word: bool, wrong: dict[int, str], sample: list[list[str]]
    ) -> ForeignColumn:
        name = self.names[place]
        if word:
            return ForeignColumn(name, None, list(itertools.chain.from_iterable(parts)))
        unit, source = self._unit(place, name, [row[place] for row in sample])
        faults = wrong | {row: fault for row, fault in self.wrong_rows.items() if place >= 0}
        return ForeignColumn(name, np.concatenate(parts), None, unit, source, wrong=faults)

    def _unit(self, place: int, name: str, cells: list[str]) -> tuple[Unit | None, str]:
        if place < len(self.dialect.units):
            unit = unit_of(self.dialect.units[place])
            if unit is not None:
                return unit, "the row of units"
        unit = split_name(name)[1]
        if unit is not None:
            return unit, "the header"
        written = unit_in_cells(cells)
        unit = unit_of(written) if written else None
        return unit, "its cells" if unit else ""

    def _remarks(self, decimals: list[Decimal], word: list[bool], decimal_remark: str) -> list[str]:
        dialect = self.dialect
        first = [f"columns separated by {SIGN_NAMES.get(dialect.separator, repr(dialect.separator))}"]
        if decimal_remark:
            first.append(decimal_remark)
        if self.text.said:
            first.append(f"encoded in {self.text.said}")
        first.append(
            f"names in line {dialect.header_line}"
            if dialect.header_line
            else "no header: columns are 1, 2, ..."
        )
        if dialect.units:
            first.append("units in the row below")
        remarks = ["; ".join(first), *dialect.passed]
        if self.remarked:
            remarks.append(f"{self.remarked} lines of comment passed over")
        if self.not_rows:
            remarks.append(f"{_at_lines(self.not_rows)}: no samples, passed over")
        if self.over_lines:
            remarks.append(f"{_at_lines(self.over_lines)}: a cell goes over several lines, by its quotes")
        if self.cut_short:
            remarks.append(f"{_at_lines(self.cut_short)}: cut off at the end of the file, left out")
        return remarks


def _at_lines(lines: list[int]) -> str:
    shown = ", ".join(map(str, lines[:3])) + (" ..." if len(lines) > 3 else "")
    return f"line{'s' if len(lines) > 1 else ''} {shown}"


def _all_empty(parts: list[Any]) -> bool:
    for part in parts:
        if isinstance(part, np.ndarray):
            if part.dtype.kind != "f" or not np.isnan(part).all():
                return False
        elif any(cell for cell in part):
            return False
    return True
