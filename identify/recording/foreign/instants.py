"""Times written in words (ISO 8601, dates with a time of day, times of day) and numbers that count since an epoch."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date

import numpy as np
from numpy.typing import NDArray

NANOSECOND = 1e-9
DAY = 86_400 * 10**9
"""ns"""

_OF_DAY = (
    r"(?:(?P<h>\d{1,3}):(?P<m>\d{2})(?::(?P<s>\d{2}))?(?P<f>[.,:]\d+)?\s*(?P<half>[AaPp]\.?[Mm]\.?)?)"
    r"\s*(?P<zone>Z|z|UTC|GMT|[+-]\d{2}:?\d{2}|[+-]\d{2})?"
)
_DATED = re.compile(
    r"^(?:\w{2,9}\.?,?\s+)?(?P<a>\d{1,4})(?P<mark>[-./])(?P<b>\d{1,2})(?P=mark)(?P<c>\d{1,4})(?:(?:T|t|,?\s+|_)"
    + _OF_DAY
    + r")?$"
)
_COMPACT = re.compile(
    r"^(?P<y>\d{4})(?P<o>\d{2})(?P<d>\d{2})[Tt_](?P<h>\d{2})(?P<m>\d{2})(?P<s>\d{2})(?P<f>[.,]\d+)?(?P<zone>Z|[+-]\d{2}:?\d{2})?$"
)
_TIMED = re.compile(rf"^(?:(?P<days>\d{{1,5}})(?:\s*[Dd](?:ays?)?,?\s+|[./]|\s+))?\+?{_OF_DAY}$")
"""A time of day, or a span of time with days before it as pandas ("1 days 23:59:59.7") and .NET ("1.23:59:59.7") write it."""

EPOCHS = (
    (5e8, 4.2e9, 1.0, "s since 1970"),
    (5e11, 4.2e12, 1e-3, "ms since 1970"),
    (5e14, 4.2e15, 1e-6, "µs since 1970"),
    (1.2e17, 1.6e17, 1e-7, "100 ns since 1601"),
    (5e17, 4.2e18, 1e-9, "ns since 1970"),
)
"""Lowest and highest number, s of one count, words: clocks of computers between the years 1985 and 2103 (1980 and 2107
for the third, Windows' FILETIME)."""


def is_instant(text: str) -> bool:
    """Whether a cell is a date with or without a time of day, or a time of day."""
    return bool(_TIMED.match(text) or _DATED.match(text) or _COMPACT.match(text))


def epoch_of(first: float, last: float) -> tuple[float, str] | None:
    """s of one count and words, where both numbers can only be a computer's clock; else None."""
    for low, high, unit, description in EPOCHS:
        if low <= first <= high and low <= last <= high:
            return unit, description
    return None


def parse_instants(texts: Sequence[str]) -> tuple[NDArray[np.int64], bool] | int:
    """(N,) ns of each text since 1970 (since midnight for times of day), and whether they are dated.

    A time of day that falls back by more than half a day has passed midnight. Of 3/4/2026 and its like, whether day
    or month comes first is told by the column as a whole. Returns instead the index of the first text that is no time.
    """
    day_first = _day_first(texts)
    instants = np.empty(len(texts), dtype=np.int64)
    dated = False
    for index, text in enumerate(texts):
        value = _nanoseconds(text.strip(), day_first)
        if value is None:
            return index
        instants[index], dated = value
    if not dated and len(instants) > 1:
        steps = np.diff(instants)
        days = np.cumsum(np.where(steps < -DAY // 2, 1, 0))
        instants[1:] += days * DAY
    return instants, dated


def _day_first(texts: Sequence[str]) -> bool:
    for text in texts:
        match = _DATED.match(text.strip())
        if match is None:
            return True
        if len(match["a"]) > 2 or match["mark"] != "/" or int(match["a"]) > 12:
            return True
        if int(match["b"]) > 12:
            return False
    return False


def _nanoseconds(text: str, day_first: bool) -> tuple[int, bool] | None:
    timed = _TIMED.match(text)
    if timed:
        return _of_day(timed), False
    compact = _COMPACT.match(text)
    if compact:
        return _of_date(int(compact["y"]), int(compact["o"]), int(compact["d"]), _of_day(compact))
    dated = _DATED.match(text)
    if dated is None:
        return None
    a, b, c = int(dated["a"]), int(dated["b"]), int(dated["c"])
    if len(dated["a"]) == 4:
        year, month, day = a, b, c
    else:
        year, month, day = (c, b, a) if day_first or dated["mark"] == "." else (c, a, b)
    within = 0 if dated["h"] is None else _of_day(dated)
    return _of_date(year + 2000 if year < 100 else year, month, day, within)


def _of_date(year: int, month: int, day: int, within: int) -> tuple[int, bool] | None:
    try:
        return (date(year, month, day).toordinal() - date(1970, 1, 1).toordinal()) * DAY + within, True
    except ValueError:
        return None


def _of_day(match: re.Match[str]) -> int:
    """ns since midnight, in UTC where the zone is stated."""
    parts = match.groupdict()
    hours, minutes, seconds = int(parts["h"]), int(parts["m"]), int(parts["s"] or 0)
    fraction = (parts["f"] or ".0")[1:]
    if parts["s"] is None and parts["f"]:  # minutes and seconds with their fraction
        hours, minutes, seconds = 0, hours, minutes
    half = (parts.get("half") or "").lower().replace(".", "")
    if half:
        hours = hours % 12 + (12 if half == "pm" else 0)
    hours += 24 * int(parts.get("days") or 0)
    zone = 0
    written = parts["zone"] or ""
    if written[:1] in ("+", "-"):
        digits = written[1:].replace(":", "").ljust(4, "0")
        zone = (int(digits[:2]) * 60 + int(digits[2:])) * (-1 if written[0] == "-" else 1)
    return ((hours * 60 + minutes - zone) * 60 + seconds) * 10**9 + int(fraction[:9].ljust(9, "0"))
