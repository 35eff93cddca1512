"""Which column of a foreign file is what, in which unit: from a table to the samples of a session in SI."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.recording.errors import InputError
from identify.recording.foreign.repair import (
    Repair,
    bridged,
    refuse_coarse_clock,
    refuse_other_unit,
    repaired_stamps,
)
from identify.recording.foreign.table import Clock, ForeignColumn, ForeignTable, unit_words
from identify.recording.plain_text import quoted
from identify.recording.sampling import SHORTEST_SEGMENT
from identify.recording.session_csv import write_csv_session
from identify.recording.units import SI_NAMES, Unit, in_brackets, unit_of

Array = NDArray[np.float64]

NOT_STATED = "as no unit is stated"
MOST_TURNS = 3
"""Between the end positions of a robot's joint; wrists turn a little more than twice. What covers more, and states no unit, may
be in degrees: 20 of them taken as rad are these."""
_OWN_NAMES = re.compile(r"^(t|(q|v|ext|temp)\d+)$")


@dataclass(frozen=True)
class ColumnMap:
    """Which columns of a foreign file are what, joint by joint."""

    position: tuple[str, ...]
    command: tuple[str, ...]
    time: str | None = None
    """None: the samples are uniform, `rate` of them a second."""
    rate: float | None = None
    """Hz; None: as the file states"""
    time_unit: str | None = None
    position_unit: tuple[str, ...] = ()
    """None (by the file, else rad or m), one for all joints, or one for each: a unit, or a number: SI for one."""
    command_unit: tuple[str, ...] = ()
    """None: by the file, else A."""
    resolution: tuple[float, ...] = ()
    """Counts per turn (or metre) of the joint, for positions in counts."""
    external: tuple[str, ...] = ()
    temperature: tuple[str, ...] = ()
    extra: tuple[str, ...] = ()
    """Columns to keep beside."""
    joined: tuple[str, ...] = ()
    """Time column of each of the files that make one session, so that another one is joined alike; none: it is one file."""
    joined_unit: str | None = None
    """The unit of these."""


@dataclass(frozen=True)
class MeasuredSession:
    """The samples of a session in SI, and what was decided on the way."""

    time: Array
    """(N,) s, increasing"""
    position: Array
    """(N, n) rad or m"""
    command: Array
    """(N, n) in the unit that the drive gain counts in"""
    external: Array | None
    temperature: Array | None
    extra: dict[str, NDArray[Any]] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    def write(self, path: Path) -> None:
        """As a session by the contract (`write_csv_session`)."""
        write_csv_session(
            path, self.time, self.position, self.command, self.external, self.temperature, self.extra
        )


@dataclass(frozen=True)
class _Role:
    """What columns of one kind are for, and the units they may have."""

    words: str
    option: str
    quantities: tuple[str, ...]
    default: str

    def unit(self, column: ForeignColumn, given: str | None, table: ForeignTable) -> tuple[Unit, str]:
        """The unit of a column and where it is from: the option, the file, or the default.

        Raises InputError: it is not known, or of another quantity.
        """
        known = ", ".join(f"{SI_NAMES[quantity]} ({quantity})" for quantity in self.quantities)
        if given is not None:
            unit = unit_of(given) or _factor(given, self)
            if unit is None:
                raise InputError(
                    f"{self.option}-unit: '{given}' is not known; use a unit of {known}, or a number"
                )
            if unit.quantity not in self.quantities:
                raise InputError(
                    f"{self.option}-unit: '{given}' is a unit of {unit.quantity}; use one of {known}"
                )
            return unit, "as given"
        if column.unit is not None:
            if column.unit.quantity not in self.quantities:
                raise InputError(
                    f"{table.path}: column '{column.name}' is in {column.unit.name} ({column.unit.quantity}) by"
                    f" {column.unit_source}, which is no {self.words}; name another column, or say {self.option}-unit"
                )
            return column.unit, f"by {column.unit_source}"
        unit = unit_of(self.default)
        assert unit is not None
        return unit, NOT_STATED


def _factor(text: str, role: _Role) -> Unit | None:
    try:
        value = float(text)
    except ValueError:
        return None
    if not np.isfinite(value) or value == 0:
        raise InputError(f"{role.option}-unit: '{text}' must be a finite number other than 0")
    return Unit(f"{value:g}", role.quantities[0], value)


COMMAND = _Role("command", "--command", ("current", "voltage", "torque", "force", "ratio", "counts"), "A")
EXTERNAL = _Role("external force", "--external", ("torque", "force"), "Nm")
TEMPERATURE = _Role("temperature", "--temperature", ("temperature",), "°C")


def _position_role(prismatic: bool) -> _Role:
    quantity = "length" if prismatic else "angle"
    return _Role("position", "--position", (quantity, "counts"), "m" if prismatic else "rad")


def measure(
    table: ForeignTable, columns: ColumnMap, prismatic: Sequence[bool], repair: Repair | None = None
) -> MeasuredSession:
    """The samples of a session from the columns of a foreign file.

    prismatic : (n,) whether each joint slides

    Raises InputError: names the file and column, or the option.
    """
    n = len(prismatic)
    if len(columns.position) != n or len(columns.command) != n:
        raise InputError(
            f"{table.path}: {len(columns.position)} position and {len(columns.command)} command columns for {n}"
            f" joint{'s' if n > 1 else ''}; give one of each for every joint"
        )
    _refuse_two_roles(table, columns)
    taken = _Taken(table, columns, prismatic)
    return taken.session(repair)


def _refuse_two_roles(table: ForeignTable, columns: ColumnMap) -> None:
    taken: dict[int, str] = {}
    for name, role in named_roles(columns):
        place = table.place(name, role)
        if place in taken:
            raise InputError(
                f"{table.path}: column '{name}' (column {place + 1}) is given as {taken[place]} and as {role};"
                " each column has one role"
            )
        taken[place] = role


def named_roles(columns: ColumnMap) -> list[tuple[str, str]]:
    """Each column's name and what it is for, in words."""
    uses = [(columns.time, "the time")] if columns.time else []
    for names, use in (
        (columns.position, "the position of joint"),
        (columns.command, "the command of joint"),
        (columns.external, "the external force of joint"),
        (columns.temperature, "the temperature of joint"),
    ):
        uses += [(name, f"{use} {joint}") for joint, name in enumerate(names, start=1)]
    return uses + [(name, "an extra column") for name in columns.extra]


class _Taken:
    """Takes the columns out of a table, one after the other, and remembers what is to be said."""

    def __init__(self, table: ForeignTable, columns: ColumnMap, prismatic: Sequence[bool]) -> None:
        self.table, self.columns, self.prismatic = table, columns, prismatic
        self.remarks: list[str] = []
        first = columns.position[0]
        self.length = len(table.column(first, "the position of joint 1"))
        if self.length < SHORTEST_SEGMENT:
            raise InputError(
                f"{table.path}: '{first}' has {self.length} samples; that is too few for a session"
            )

    def session(self, repair: Repair | None) -> MeasuredSession:
        n = len(self.prismatic)
        groups = {
            "position": self._positions(),
            "command": self._group(self.columns.command, COMMAND, self.columns.command_unit, n),
        }
        if self.columns.external:
            groups["external"] = self._group(self.columns.external, EXTERNAL, (), n)
        if self.columns.temperature:
            groups["temperature"] = self._group(self.columns.temperature, TEMPERATURE, (), n)
        extra = {self._kept_name(name): self._extra(name) for name in self.columns.extra}
        time = self._time(repair)
        numeric = {name: values[:, None] for name, values in extra.items() if values.dtype != object}
        time, rows, values = self._repaired(time, groups | numeric, repair)
        if self.columns.time is not None:
            refuse_other_unit(time, f"{self.table.path}: column '{self.columns.time}'")
        kept = {name: values[name][:, 0] if name in numeric else extra[name][rows] for name in extra}
        return MeasuredSession(
            time,
            values["position"],
            values["command"],
            values.get("external"),
            values.get("temperature"),
            kept,
            (*self.table.remarks, *self.remarks),
        )

    def _column(self, name: str, used_for: str) -> ForeignColumn:
        column = self.table.column(name, used_for)
        if len(column) != self.length:
            raise InputError(
                f"{self.table.path}: column '{name}' has {len(column)} samples, the first position {self.length}"
            )
        return column

    def _numbers(self, name: str, used_for: str) -> ForeignColumn:
        column = self._column(name, used_for)
        if column.numbers is None:
            shown = next((word for word in column.words or () if word), "")
            raise InputError(
                f"{self.table.path}: column '{name}' for {used_for} holds words ({quoted(shown)}), not numbers"
            )
        return column

    def _positions(self) -> Array:
        n = len(self.prismatic)
        given = _for_each(self.columns.position_unit, n, "--position-unit", "units")
        resolution = _for_each(self.columns.resolution, n, "--resolution", "values")
        positions = []
        for joint, name in enumerate(self.columns.position):
            role = _position_role(self.prismatic[joint])
            column = self._numbers(name, f"the position of joint {joint + 1}")
            assert column.numbers is not None
            unit, source = role.unit(column, given[joint], self.table)
            if unit.quantity == "counts":
                counts = resolution[joint]
                if counts is None:
                    raise InputError(
                        f"--resolution is missing: counts per {'metre' if self.prismatic[joint] else 'turn'} of joint"
                        f" {joint + 1}, as column '{name}' is in counts {source}"
                    )
                if not np.isfinite(counts) or counts == 0:
                    raise InputError(f"--resolution: {counts:g} must be a finite number other than 0")
                factor = (1.0 if self.prismatic[joint] else 2 * np.pi) / counts
                unit = Unit(
                    f"counts, {counts:g} a {'metre' if self.prismatic[joint] else 'turn'},",
                    unit.quantity,
                    factor,
                )
                self._say(name, f"{unit.name} -> {'m' if self.prismatic[joint] else 'rad'} {source}")
            else:
                self._say_unit(name, unit, source)
                if source == NOT_STATED and not self.prismatic[joint]:
                    self._say_turns(name, column.numbers)
            positions.append(unit.to_si(column.numbers))
        return np.stack(positions, axis=1)

    def _say_turns(self, name: str, numbers: NDArray[Any]) -> None:
        """Say that positions taken as rad are of more turns than a robot's joint has."""
        finite = numbers[np.isfinite(numbers)]
        turns = float(np.ptp(finite)) / (2 * np.pi) if len(finite) else 0.0
        if turns > MOST_TURNS:
            self._say(
                name, f"taken as rad, {NOT_STATED}: {turns:.3g} turns; state the unit if these are degrees"
            )

    def _group(self, names: tuple[str, ...], role: _Role, units: tuple[str, ...], n: int) -> Array:
        if len(names) != n:
            raise InputError(
                f"{role.option}: {len(names)} column{'s' if len(names) > 1 else ''} for {n} joints"
            )
        given = _for_each(units, n, f"{role.option}-unit", "units")
        values = []
        for joint, name in enumerate(names):
            column = self._numbers(name, f"the {role.words} of joint {joint + 1}")
            assert column.numbers is not None
            unit, source = role.unit(column, given[joint], self.table)
            self._say_unit(name, unit, source)
            values.append(unit.to_si(column.numbers))
        return np.stack(values, axis=1)

    def _extra(self, name: str) -> NDArray[Any]:
        column = self._column(name, "an extra column")
        if column.numbers is None:
            return np.array(column.words, dtype=object)
        if column.unit is None:
            return column.numbers.astype(np.float64)
        self._say_unit(name, column.unit, f"by {column.unit_source}")
        return column.unit.to_si(column.numbers)

    def _kept_name(self, name: str) -> str:
        """The name of an extra column in the session: without its unit, nor what a session's own columns are called."""
        plain = (
            re.sub(r'[:,;"\s]+', "_", self.table.column(name, "an extra column").base_name).strip("_")
            or "kept"
        )
        if _OWN_NAMES.match(plain):
            plain += "_recorded"
            self._say(name, f"kept as {plain}")
        return plain

    def _time(self, repair: Repair | None) -> Array:
        name, rate, stated = self.columns.time, self.columns.rate, self.table.period
        if name is None:
            if rate is None and stated is not None:
                self.remarks.append(f"no time column: {stated.said}")
                return np.arange(self.length, dtype=np.float64) * stated.seconds
            if rate is None or not rate > 0 or not np.isfinite(rate):
                raise InputError(
                    f"{self.table.path}: no time column; give --time COLUMN, or --rate HZ above 0"
                )
            return np.arange(self.length) / rate
        self._column(name, "the time")
        clock = self.clock(name)
        refuse_coarse_clock(clock.seconds, clock, f"{self.table.path}: column '{name}'", repair)
        self.remarks.append(clock.said)
        return clock.seconds

    def clock(self, name: str) -> Clock:
        """The session's clock."""
        return self.table.clock(name, self.columns.time_unit)

    def _say(self, name: str, remark: str) -> None:
        self.remarks.append(f"{name}: {remark}")

    def _say_unit(self, name: str, unit: Unit, source: str) -> None:
        converted = unit_words(unit)
        if converted or source.startswith("by"):
            self._say(name, f"{converted or unit.name} {source}")
        elif source == NOT_STATED and (unknown := in_brackets(name)):
            self._say(name, f"'{unknown}' is no unit that is known; taken as {unit.name}")

    def _repaired(
        self, time: Array, groups: dict[str, Array], repair: Repair | None
    ) -> tuple[Array, NDArray[np.intp], dict[str, Array]]:
        """Times that increase, the rows kept, and values that are all finite."""
        rows = np.arange(self.length)
        if repair is None:
            self._refuse_faults(time)
        if not np.isfinite(time).all():
            known = np.isfinite(time)
            self.remarks.append(f"{int((~known).sum())} samples without a time left out")
            time, rows = time[known], rows[known]
        if not (np.diff(time) > 0).all():
            assert repair is not None
            time, kept, repairs = repaired_stamps(time, repair)
            rows = rows[kept]
            self.remarks += repairs
        stacked = np.concatenate([values[rows] for values in groups.values()], axis=1)
        usable: NDArray[np.bool_] = np.asarray(np.isfinite(stacked).all(axis=1))
        if not usable.all():
            stacked = np.where(np.isfinite(stacked), stacked, np.nan)
            count = 0
            if repair == "bridge":
                stacked, usable, count = bridged(time, stacked)
                self.remarks.append(f"{count} missing values bridged by interpolation")
            left_out = int((~usable).sum())
            if left_out:
                self.remarks.append(f"{left_out} of {len(usable)} samples without a value left out")
            time, rows, stacked = time[usable], rows[usable], stacked[usable]
        if len(time) < SHORTEST_SEGMENT:
            raise InputError(
                f"{self.table.path}: {len(time)} samples are left; that is too few for a session"
            )
        edges = np.cumsum([values.shape[1] for values in groups.values()])[:-1]
        return time, rows, dict(zip(groups, np.split(stacked, edges, axis=1), strict=True))

    def _refuse_faults(self, time: Array) -> None:
        remedy = "; --repair drop leaves such samples out, --repair bridge bridges them"
        for name, used_for in named_roles(self.columns):
            column = self.table.column(name, used_for)
            if column.numbers is None:
                continue
            finite = np.isfinite(column.numbers)
            if not finite.all():
                index = int(np.argmin(finite))
                cell = column.wrong.get(index)
                fault = f"{quoted(cell)} is not a finite number" if cell else "not a finite number"
                raise InputError(
                    f"{self.table.path}: column '{name}', {self.table.sample(index)}: {fault}{remedy}"
                )
        steps = np.diff(time)
        if (steps <= 0).any():
            index = int(np.argmax(steps <= 0)) + 1
            raise InputError(
                f"{self.table.path}: column '{self.columns.time}', {self.table.sample(index)}: time does not increase"
                f" ({int((steps == 0).sum())} stamps repeat, {int((steps < 0).sum())} go back){remedy}"
            )


def _for_each(given: Sequence[Any], n: int, option: str, what: str) -> list[Any]:
    if not given:
        return [None] * n
    if len(given) not in (1, n):
        raise InputError(f"{option}: {len(given)} {what} for {n} joints; give one, or {n}")
    return list(given) * (n // len(given))
