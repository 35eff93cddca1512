"""Units by their names, as people and instruments write them, and what one is in SI."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Unit:
    """A unit of measurement: value in SI = factor * number + offset."""

    name: str
    quantity: str
    """time, angle, length, angular velocity, velocity, current, voltage, torque, force, ratio, temperature, counts"""
    factor: float
    offset: float = 0.0

    def to_si(self, numbers: ArrayLike) -> Array:
        """Numbers in this unit as values in SI (temperatures in °C; shares in percent; counts stay counts)."""
        return np.asarray(numbers, dtype=np.float64) * self.factor + self.offset


SI_NAMES = {
    "time": "s",
    "angle": "rad",
    "length": "m",
    "angular velocity": "rad/s",
    "velocity": "m/s",
    "current": "A",
    "voltage": "V",
    "torque": "N m",
    "force": "N",
    "ratio": "percent",
    "temperature": "°C",
    "counts": "counts",
}
"""Quantity -> what numbers count in after conversion."""

_TURN = 2 * np.pi
_WRITTEN: tuple[tuple[str, float, float, str], ...] = (
    ("time", 1.0, 0.0, "s sec secs second seconds sek Sekunden"),
    ("time", 1e-3, 0.0, "ms msec millisecond milliseconds"),
    ("time", 1e-6, 0.0, "us µs μs usec microsecond microseconds"),
    ("time", 1e-7, 0.0, "100ns"),
    ("time", 1e-9, 0.0, "ns nsec nanosecond nanoseconds"),
    ("time", 60.0, 0.0, "min minute minutes"),
    ("time", 3600.0, 0.0, "h hr hour hours"),
    ("time", 86400.0, 0.0, "d day days"),
    ("angle", 1.0, 0.0, "rad radian radians"),
    ("angle", 1e-3, 0.0, "mrad"),
    ("angle", np.pi / 180, 0.0, "deg ° º degree degrees Grad"),
    ("angle", np.pi / 180e3, 0.0, "mdeg"),
    (
        "angle",
        _TURN,
        0.0,
        "turn turns rev revs revolution revolutions U Umdr Umdrehung Umdrehungen tr tour tours giri",
    ),
    ("length", 1.0, 0.0, "m metre metres meter meters"),
    ("length", 1e-2, 0.0, "cm"),
    ("length", 1e-3, 0.0, "mm"),
    ("length", 1e-6, 0.0, "um µm μm"),
    ("length", 0.0254, 0.0, "in inch inches"),
    ("angular velocity", 1.0, 0.0, "rad/s rad/sec rads^-1 rads-1"),
    ("angular velocity", np.pi / 180, 0.0, "deg/s °/s deg/sec dps degs^-1"),
    ("angular velocity", _TURN / 60, 0.0, "rpm 1/min min^-1 min-1 U/min rev/min r/min"),
    ("angular velocity", _TURN, 0.0, "rps rev/s turn/s turns/s U/s"),
    ("velocity", 1.0, 0.0, "m/s m/sec ms^-1 ms-1"),
    ("velocity", 1e-3, 0.0, "mm/s mm/sec"),
    ("current", 1.0, 0.0, "A Amp Amps ampere amperes Arms A_rms Aeff Apk"),
    ("current", 1e-3, 0.0, "mA mArms milliampere"),
    ("voltage", 1.0, 0.0, "V volt volts"),
    ("voltage", 1e-3, 0.0, "mV"),
    ("torque", 1e3, 0.0, "kNm"),
    ("torque", 1.0, 0.0, "Nm"),
    ("torque", 1e-2, 0.0, "Ncm"),
    ("torque", 1e-3, 0.0, "Nmm mNm"),
    ("torque", 1e-6, 0.0, "uNm µNm μNm"),
    ("force", 1e3, 0.0, "kN"),
    ("force", 1.0, 0.0, "N newton newtons"),
    ("force", 1e-3, 0.0, "mN"),
    ("ratio", 1.0, 0.0, "% percent pct Prozent"),
    ("ratio", 0.1, 0.0, "‰ permille permil promille o/oo"),
    ("temperature", 1.0, 0.0, "°C ºC degC celsius"),
    ("temperature", 1.0, -273.15, "K kelvin"),
    ("temperature", 5 / 9, -160 / 9, "°F ºF degF fahrenheit"),
    ("counts", 1.0, 0.0, "counts count cts cnt cnts inc incs incr increments Inkremente ticks pulses LSB qc"),
)
_EXACT = {
    word: Unit(words.split()[0], quantity, factor, offset)
    for quantity, factor, offset, words in _WRITTEN
    for word in words.split()
}
_FOLDED: dict[str, Unit] = {}
for _word, _unit in _EXACT.items():
    _FOLDED.setdefault(_word.casefold(), _unit)

_BRACKETED = re.compile(r"^(.*?)[\s_]*(?:\[([^\]]*)\]|\(([^)]*)\)|\{([^}]*)\}|<([^>]*)>)\s*$")
_DIVIDED = re.compile(r"^(.*\S)\s*/\s*(\S+(?: \S+)?)\s*$")
_WORDED = re.compile(r"^(.*\S)\s+in\s+(\S+(?: \S+)?)\s*$")
_ENDING = re.compile(r"^(.+)[_.]([^\W_]+)$")
_SPEAKING_ENDING = re.compile(
    r"m?deg|degrees?|m?rad|[mu]m|rpm|m[av]|nm|nmm|mnm|[mun]s|[mun]?sec|counts|degc", re.IGNORECASE
)
"""Endings of a name after '_' that are units and hardly anything else (q_m is the motor's position, not metres)."""


def unit_of(text: str) -> Unit | None:
    """The unit that a text names, or None. Spaces and signs of multiplication inside it do not matter."""
    bare = re.sub(r"[\s·*⋅]", "", text.strip().strip("[](){}<>"))
    bare = bare.replace("N-m", "Nm").replace("N.m", "Nm").rstrip(".")
    return _EXACT.get(bare) or _FOLDED.get(bare.casefold())


def in_brackets(name: str) -> str:
    """What stands in brackets at the end of a column's name, where a unit mostly stands; "" for nothing."""
    match = _BRACKETED.match(name)
    inside = next((part for part in match.groups()[1:] if part), "") if match and match[1].strip() else ""
    return "" if inside.isdecimal() else inside  # an index: position[0]


def split_name(name: str) -> tuple[str, Unit | None]:
    """The name of a column without its unit, and that unit: "pos [deg]", "pos (deg)", "pos / deg", "pos_deg"."""
    bracketed = _BRACKETED.match(name)
    if bracketed:
        unit = unit_of(next(part for part in bracketed.groups()[1:] if part is not None))
        if unit is not None and bracketed[1].strip():
            return bracketed[1].strip(), unit
    for pattern in (_DIVIDED, _WORDED):
        match = pattern.match(name)
        unit = unit_of(match[2]) if match else None
        if match and unit is not None:
            return match[1], unit
    ending = _ENDING.match(name)
    if ending and _SPEAKING_ENDING.fullmatch(ending[2]):
        return ending[1], unit_of(ending[2])
    return name, None
