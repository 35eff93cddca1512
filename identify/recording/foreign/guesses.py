"""What the columns of a foreign file probably are, told by their names and units: proposed, never decided."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from identify.recording.errors import InputError
from identify.recording.foreign.table import ForeignColumn, ForeignTable


def _words(written: str) -> frozenset[str]:
    return frozenset(written.split())


TIME = _words(
    "t time timestamp stamp zeit zeitstempel uhrzeit temps tempo tiempo datetime date datum sec secs"
)
POSITION = _words(
    "q pos position positions qpos angle angles winkel lage stellung theta phi posizione posicion angulo angolo"
)
COMMAND = _words(
    "i iq cur curr current currents strom courant corriente corrente amps torque torques trq effort tau moment"
    " drehmoment couple coppia force kraft command v u"
)
OTHER = _words(
    "vel velocity velocities speed dq qd qdd ddq geschwindigkeit drehzahl vitesse acc accel acceleration"
    " beschleunigung temp temperature temperatur error err fehler deviation abweichung limit status mode"
)
"""Words of what is neither."""
SET_POINT = _words("ref reference des desired cmd target soll setpoint demand consigne goal nominal sollwert")
MEASURED = _words("act actual ist measured meas mes feedback fb istwert")
SHORTEST_PART = 4
"""Letters of a word that is also found inside another one: `strom` in `Motorstrom`, but no `v` in `drive`."""

_TOKENS = re.compile(r"[A-ZÄÖÜ]?[a-zäöüßáéíóúµ]+|[A-ZÄÖÜ]+(?![a-zäöü])|\d+")


@dataclass(frozen=True)
class GuessedRoles:
    """Columns by the names that `ForeignTable.column` takes; empty where nothing speaks for any."""

    time: str | None
    position: tuple[str, ...]
    """Base to tip, as far as the names are numbered; else in the file's order."""
    command: tuple[str, ...]
    """As many as positions, or none."""


@dataclass(frozen=True)
class _Named:
    """A column of numbers with what its name says."""

    name: str
    stem: str
    """The name without its numbers."""
    numbers: tuple[int, ...]
    tokens: tuple[str, ...]
    quantity: str | None

    def says(self, vocabulary: frozenset[str]) -> bool:
        return any(
            token in vocabulary or any(word in token for word in vocabulary if len(word) >= SHORTEST_PART)
            for token in self.tokens
        )


def guess_roles(table: ForeignTable) -> GuessedRoles:
    """Which columns are the time, and the position and command of each joint.

    Where the kind of file knows of joints, these are theirs. Otherwise a name speaks by its words in the languages that
    control cabinets are written in, a unit by its quantity, and columns that differ in a number alone belong together.
    """
    time = _time(table)
    if table.joints:
        position = tuple(f"{joint}.position" for joint in table.joints)
        command = tuple(f"{joint}.effort" for joint in table.joints)
        if all(table.has(name) for name in (*position, *command)):
            return GuessedRoles(time, position, command)
    named = [each for each in _named(table) if each.name != time]
    positions = _family(named, POSITION, ("angle", "length", "counts"), set_points=False)
    others = [each for each in named if each not in positions]
    commands = _family(
        others, COMMAND, ("current", "torque", "force", "voltage", "ratio"), set_points=True, n=len(positions)
    )
    if not positions:
        commands = []
    return GuessedRoles(time, tuple(each.name for each in positions), tuple(each.name for each in commands))


def _named(table: ForeignTable) -> list[_Named]:
    names = [column.name for column in table.columns]
    return [
        _read_name(column, column.name if column.name and names.count(column.name) == 1 else f"#{place}")
        for place, column in enumerate(table.columns, start=1)
        if column.numbers is not None and not column.absolute
    ]


def _read_name(column: ForeignColumn, name: str) -> _Named:
    tokens = _TOKENS.findall(column.base_name)
    numbers = tuple(int(token) for token in tokens if token.isdecimal())
    spoken = tuple(token.casefold() for token in tokens if not token.isdecimal())
    quantity = column.unit.quantity if column.unit else None
    return _Named(name, " ".join(spoken), numbers, spoken, quantity)


def _family(
    columns: Sequence[_Named],
    vocabulary: frozenset[str],
    quantities: tuple[str, ...],
    *,
    set_points: bool,
    n: int | None = None,
) -> list[_Named]:
    """The columns of all joints that speak most for one meaning; n : as many as these, or none."""
    scores = {each: _score(each, vocabulary, quantities, set_points) for each in columns}
    likely = [each for each in columns if scores[each] > 0]
    best: list[_Named] = []
    for score in sorted({scores[each] for each in likely}, reverse=True):
        of_score = [each for each in likely if scores[each] == score]
        stems = dict.fromkeys(each.stem for each in of_score)
        families = [[each for each in of_score if each.stem == stem] for stem in stems]
        if all(len(family) == 1 for family in families):  # joints told apart by words
            families.insert(0 if n is None or len(families) == n else 1, [family[0] for family in families])
        fitting = [family for family in families if n is None or len(family) == n]
        if fitting:
            best = fitting[0] if n is not None else max(fitting, key=len)
            break
    if len({each.numbers for each in best}) == len(best):
        best = sorted(best, key=lambda each: each.numbers)
    return best


def _score(column: _Named, vocabulary: frozenset[str], quantities: tuple[str, ...], set_points: bool) -> int:
    """How much speaks for a meaning; 0 for nothing."""
    said = column.says(vocabulary)
    if column.says(OTHER) or (column.quantity is not None and column.quantity not in quantities):
        return 0
    if not said and column.quantity in (None, "counts", "ratio"):
        return 0
    if not set_points and column.says(SET_POINT):
        return 0
    return 1 + 2 * said + (column.quantity is not None) + column.says(MEASURED)


def _time(table: ForeignTable) -> str | None:
    if table.time is not None:
        return table.time
    likely: list[tuple[int, str]] = []
    for place, column in enumerate(table.columns, start=1):
        if column.numbers is not None and np.isnan(column.numbers).all():
            continue
        name = (
            column.name
            if column.name and sum(column.name == c.name for c in table.columns) == 1
            else f"#{place}"
        )
        spoken = {token.casefold() for token in _TOKENS.findall(column.base_name)}
        of_time = column.unit is not None and column.unit.quantity == "time"
        if column.absolute:
            likely.append((4, name))
        elif column.unit is not None and not of_time:
            continue
        elif spoken & TIME or of_time:
            likely.append((2 + of_time, name))
        elif place == 1 and _increases(column) and not (table.period is not None and _counts(column)):
            likely.append((1, name))
    for _, name in sorted(likely, key=lambda each: -each[0]):
        with suppress(InputError):
            seconds = table.clock(name, None).seconds
            if np.nanmax(seconds) > np.nanmin(seconds):  # dates may stand beside times of day
                return name
    return None


def _counts(column: ForeignColumn) -> bool:
    """Whether a column numbers the samples one by one."""
    return column.numbers is not None and bool(np.all(np.diff(column.numbers) == 1))


def _increases(column: ForeignColumn) -> bool:
    """Whether numbers grow from sample to sample, as a time does."""
    numbers = column.numbers
    return numbers is not None and len(numbers) > 1 and bool(np.all(np.diff(numbers) > 0))
