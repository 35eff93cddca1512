"""Tables in text in any dialect, written from known numbers, for tests that read them back."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

START = datetime(2026, 11, 27, 23, 59, 59, 900_000, tzinfo=UTC)
"""A tenth of a second before midnight, so that times of day wrap."""
PERIOD = 0.002
"""s"""

TIME_FORMS = (
    "s",
    "ms",
    "us",
    "ns",
    "epoch s",
    "epoch ms",
    "epoch us",
    "epoch ns",
    "iso",
    "iso local",
    "german date",
    "of day",
    "am/pm",
)
ENCODINGS = ("utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252")


@dataclass(frozen=True)
class Dialect:
    """How a table is written."""

    separator: str = ","
    decimal: str = "."
    encoding: str = "utf-8"
    line_end: str = "\n"
    quoted: bool = False
    preamble: int = 0
    """Lines above the header."""
    blank_after_preamble: bool = False
    units_row: bool = False
    units_in_names: bool = False
    comment: str = ""
    """Sign of a comment line above the header and amid the samples; "" for none."""
    trailing_separator: bool = False
    time_form: str = "s"
    header: bool = True
    final_line_end: bool = True
    thousands: str = ""

    @property
    def readable(self) -> bool:
        """Whether the cells can be told apart at all."""
        commas = self.decimal == "," or self.thousands == ","
        same = self.thousands and (self.thousands == self.decimal or self.thousands == self.separator)
        if self.separator == " " and not self.header and (self.preamble or self.comment):
            return False  # a remark of as many words as columns names them as well as a header does
        return not (commas and self.separator == "," and not self.quoted) and not same


@dataclass(frozen=True)
class Measured:
    """What is written: time from zero, an angle in degrees, a current in milliamperes, a counter."""

    time: np.ndarray
    angle: np.ndarray
    current: np.ndarray
    counter: np.ndarray

    @classmethod
    def of(cls, rows: int, offset: float = 0.0) -> Measured:
        """A smooth motion of so many rows."""
        time = np.round(np.arange(rows) * PERIOD, 6)
        return cls(
            time,
            np.round(90 * np.sin(3 * time + offset), 5),
            np.round(1500 * np.cos(2 * time - offset), 2),
            1000 + np.arange(rows),
        )


def names(dialect: Dialect) -> list[str]:
    """The names of the columns, with or without their units."""
    plain = ["Zeit", "Achse.Position", "Strom µ", "Zähler"]
    if not dialect.units_in_names:
        return plain
    unit = dialect.time_form if dialect.time_form in ("s", "ms", "us", "ns") else "s"
    return [f"Zeit [{unit}]", "Achse.Position (deg)", "Strom µ [mA]", "Zähler"]


def written(measured: Measured, dialect: Dialect) -> bytes:
    """The file."""
    sign = dialect.separator
    lines = [f"Recorder{' ' if sign != ' ' else '_'}1.{k} by hand" for k in range(dialect.preamble)]
    if dialect.preamble and dialect.blank_after_preamble:
        lines.append("")
    if dialect.comment:
        lines.append(f"{dialect.comment} a remark by somebody")
    if dialect.header:
        lines.append(
            _row(
                names(dialect) if sign != " " else [name.replace(" ", "") for name in names(dialect)], dialect
            )
        )
    if dialect.units_row:
        unit = dialect.time_form if dialect.time_form in ("s", "ms", "us", "ns") else "s"
        lines.append(_row([unit, "deg", "mA", "-"], dialect))
    for k in range(len(measured.time)):
        if dialect.comment and k == 7:
            lines.append(f"{dialect.comment} trigger")
        cells = [_time(measured.time[k], dialect)]
        cells += [
            _number(f"{measured.angle[k]:.5f}", dialect),
            _number(f"{measured.current[k]:.2f}", dialect),
        ]
        cells.append(_number(str(int(measured.counter[k])), dialect))
        lines.append(_row(cells, dialect))
    text = dialect.line_end.join(lines) + (dialect.line_end if dialect.final_line_end else "")
    return text.encode(dialect.encoding)


def _row(cells: list[str], dialect: Dialect) -> str:
    if dialect.quoted:
        cells = [f'"{cell}"' for cell in cells]
    return dialect.separator.join(cells) + (dialect.separator if dialect.trailing_separator else "")


def _number(text: str, dialect: Dialect) -> str:
    if dialect.thousands:
        whole, point, rest = text.partition(".")
        minus, digits = ("-", whole[1:]) if whole.startswith("-") else ("", whole)
        groups = [digits[max(0, end - 3) : end] for end in range(len(digits), 0, -3)]
        return minus + dialect.thousands.join(reversed(groups)) + (dialect.decimal if point else "") + rest
    return text.replace(".", dialect.decimal)


def _time(seconds: float, dialect: Dialect) -> str:
    microseconds = round(seconds * 1e6)
    form = dialect.time_form
    if form == "s":
        return f"{seconds:.6f}".replace(".", dialect.decimal)
    if form in ("ms", "us", "ns"):
        scaled = {
            "ms": f"{microseconds / 1000:.3f}",
            "us": str(microseconds),
            "ns": str(microseconds * 1000),
        }[form]
        return scaled.replace(".", dialect.decimal)
    if form.startswith("epoch"):
        total = int(START.timestamp() * 1e6) + microseconds
        if form == "epoch s":
            return f"{total // 10**6}{dialect.decimal}{total % 10**6:06d}"
        return {"epoch ms": str(total // 1000), "epoch us": str(total), "epoch ns": str(total * 1000)}[form]
    instant = START + timedelta(microseconds=microseconds)
    if form == "iso":
        return instant.isoformat(timespec="microseconds").replace("+00:00", "Z")
    if form == "iso local":
        return instant.strftime("%Y-%m-%dT%H:%M:%S") + f"{dialect.decimal}{instant.microsecond:06d}"
    if form == "german date":
        return instant.strftime("%d.%m.%Y_%H:%M:%S") + f"{dialect.decimal}{instant.microsecond:06d}"
    if form == "am/pm":
        return instant.strftime("%I:%M:%S") + f"{dialect.decimal}{instant.microsecond:06d}{instant:%p}"
    return instant.strftime("%H:%M:%S") + f"{dialect.decimal}{instant.microsecond:06d}"
