"""Named columns of a foreign file, whatever kind of file they came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.recording.errors import InputError
from identify.recording.foreign.instants import NANOSECOND, epoch_of, parse_instants
from identify.recording.foreign.stated_period import StatedPeriod
from identify.recording.units import SI_NAMES, Unit, split_name, unit_of

Array = NDArray[np.float64]
MOST_NAMES_SHOWN = 40


@dataclass(frozen=True)
class ForeignColumn:
    """One column as it stands in its file."""

    name: str
    numbers: NDArray[np.float64] | NDArray[np.int64] | None
    """(N,), NaN where there is no value; None for a column of words."""
    words: Sequence[str] | None = None
    """(N,) cells of a column of words; None for numbers."""
    unit: Unit | None = None
    unit_source: str = ""
    """Where the unit stands, in words."""
    absolute: bool = False
    """Whether numbers are ns since 1970."""
    wrong: dict[int, str] = field(default_factory=dict)
    """Sample -> the cell that is no number."""

    def __len__(self) -> int:
        return len(self.numbers if self.numbers is not None else self.words or ())

    @property
    def base_name(self) -> str:
        """The name without the unit in it."""
        return split_name(self.name)[0]


@dataclass(frozen=True)
class Clock:
    """Times of samples."""

    seconds: Array
    """(N,) s: as they stand in the file, or since the first sample where the file states instants."""
    begin: int | None
    """ns since 1970 of the first sample, where the file states it."""
    of_day: bool
    """Whether the file states times of day: `begin` counts from a midnight."""
    said: str


@dataclass(frozen=True)
class ForeignTable:
    """What a foreign file holds."""

    path: Path
    columns: tuple[ForeignColumn, ...]
    """Not all of one length."""
    scalars: dict[str, float] = field(default_factory=dict)
    """name -> number; a gain that the file itself states, for example"""
    remarks: tuple[str, ...] = ()
    """What was decided while reading, in an operator's words."""
    lines: NDArray[np.int64] | None = None
    """(N,) line of each sample in a text file."""
    time: str | None = None
    """The column that can only be the time, where the kind of file has one."""
    joints: tuple[str, ...] = ()
    """Joints that have columns JOINT.position and JOINT.effort, where the kind of file knows of joints."""
    undecided: str = ""
    """What the file leaves open of whose joints these are, in words; "" where nothing."""
    period: StatedPeriod | None = None
    """The time between samples where the file states it apart from its columns."""

    def names(self) -> str:
        """The columns in one line."""
        shown = [column.name or f"#{place}" for place, column in enumerate(self.columns, start=1)]
        more = " ..." if len(shown) > MOST_NAMES_SHOWN else ""
        return ", ".join(shown[:MOST_NAMES_SHOWN]) + more

    def has(self, name: str) -> bool:
        """Whether a column has this name."""
        return any(column.name == name for column in self.columns)

    def column(self, name: str, used_for: str) -> ForeignColumn:
        """The column of a name: as in the file, without its unit, in other capitals, or #K for the K-th.

        Raises InputError: there is none, or more than one; names those that are there.
        """
        return self.columns[self.place(name, used_for)]

    def place(self, name: str, used_for: str) -> int:
        """The place of the column of a name, from 0; as `column`."""
        numbered = name.startswith("#") and name[1:].isdecimal() and not self.has(name)
        if numbered and 1 <= int(name[1:]) <= len(self.columns):
            return int(name[1:]) - 1
        wanted = name.strip()
        for same in (
            lambda column: column.name == wanted,
            lambda column: column.base_name == wanted,
            lambda column: wanted.casefold() in (column.name.casefold(), column.base_name.casefold()),
        ):
            places = [place for place, column in enumerate(self.columns) if same(column)]
            if len(places) == 1:
                return places[0]
            if places:
                which = " and ".join(str(place + 1) for place in places)
                raise InputError(
                    f"{self.path}: column '{name}' for {used_for} stands {_times(len(places))}"
                    f" (columns {which}); rename one, or say which: '#{places[0] + 1}'"
                )
        several = [column.name for column in self.columns if column.name.startswith(f"{name}:")]
        if several:
            raise InputError(
                f"{self.path}: '{name}' has {len(several)} columns; say which for {used_for}, {several[0]} for example"
            )
        raise InputError(f"{self.path}: there is no column '{name}' for {used_for}; there are {self.names()}")

    def sample(self, index: int) -> str:
        """Where a sample stands, in words: its line in a text file."""
        if self.lines is not None and index < len(self.lines):
            return f"line {int(self.lines[index])}"
        return f"sample {index + 1}"

    def clock(self, name: str, unit: str | None) -> Clock:
        """The time column in seconds.

        unit : as given by the user, or None: by the header, by the numbers' own size, or s

        Raises InputError: the column holds no times.
        """
        column = self.column(name, "the time")
        if column.words is not None:
            return self._clock_of_words(column)
        assert column.numbers is not None
        numbers = column.numbers
        if column.absolute:
            known = numbers[np.isfinite(numbers)]
            begin = int(known[0]) if len(known) else 0
            return _since_first(numbers, NANOSECOND, begin, f"{column.name}: instants of the recording")
        first, last = (float(numbers[0]), float(numbers[-1])) if len(numbers) else (0.0, 0.0)
        given = unit_of(unit) if unit else column.unit
        if unit and (given is None or given.quantity != "time"):
            raise InputError(f"--time-unit: '{unit}' is not known; use s, ms, us, ns, min, h, d, 100ns")
        if given is not None and given.quantity != "time":
            raise InputError(
                f"{self.path}: column '{name}' is in {given.name} by {column.unit_source}, which is no time;"
                " give another --time, or --time-unit"
            )
        epoch = epoch_of(first, last)
        if epoch is not None and (not unit or (given is not None and given.factor == epoch[0])):
            step, description = epoch  # so large that a header that states another unit is wrong
            start = round(first * step / NANOSECOND)
            if description.endswith("1601"):
                start -= 11_644_473_600 * 10**9
            return _since_first(numbers, step, start, f"{column.name}: {description}")
        if given is None:
            return Clock(numbers.astype(np.float64), None, False, f"{column.name}: s (no unit is stated)")
        source = "as given" if unit else f"by {column.unit_source}"
        return Clock(given.to_si(numbers), None, False, f"{column.name}: {given.name} {source}")

    def _clock_of_words(self, column: ForeignColumn) -> Clock:
        texts = column.words or ()
        parsed = parse_instants(texts)
        if isinstance(parsed, int):
            raise InputError(
                f"{self.path}: column '{column.name}', {self.sample(parsed)}: '{texts[parsed]}' is neither a number nor"
                " a time; times are written like 2026-11-27T14:03:00.002 or 14:03:00.002"
            )
        instants, dated = parsed
        description = "dates with a time of day" if dated else "times of day"
        if not dated and len(instants) and int(instants.max()) >= 86_400 * 10**9:
            description += ", past midnight"
        clock = _since_first(instants, NANOSECOND, int(instants[0]), f"{column.name}: {description}")
        return Clock(clock.seconds, clock.begin, not dated, clock.said)


def _since_first(
    numbers: NDArray[np.int64] | NDArray[np.float64], step: float, begin: int, description: str
) -> Clock:
    if len(numbers) and begin > 86_400 * 10**9 * 365:
        instant = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=begin // 1000)
        description += f", counted from {instant.isoformat(timespec='milliseconds').replace('+00:00', 'Z')}"
    known = numbers[np.isfinite(numbers)]
    first = known[0] if len(known) else 0
    return Clock((numbers - first).astype(np.float64) * step, begin, False, description)


def _times(count: int) -> str:
    return "twice" if count == 2 else f"{count} times"


def unit_words(unit: Unit) -> str:
    """How a unit is converted, in words; "" where nothing changes."""
    target = SI_NAMES[unit.quantity]
    if unit.factor == 1.0 and unit.offset == 0.0:
        return ""
    shift = f" {unit.offset:+.9g}" if unit.offset else ""
    return f"{unit.name} -> {target} (× {unit.factor:.9g}{shift})"
