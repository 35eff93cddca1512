"""Numbers and messages as an instrument shows them: significant digits, a true minus sign, a unit after a thin space.

A figure that cannot be given is an en dash, never a zero.
"""

import math
import re
from collections.abc import Iterable
from datetime import UTC, datetime

from markupsafe import Markup, escape

MISSING = "–"
THIN = "\u202f"  # narrow space that does not break


def _given(value: float | None) -> bool:
    return value is not None and math.isfinite(value)


def number(value: float | None, decimals: int = 2) -> str:
    """With a fixed count of decimals and thin-spaced thousands from 10 000 on."""
    if value is None or not math.isfinite(value):
        return MISSING
    text = f"{value:,.{decimals}f}" if abs(value) >= 1e4 else f"{value:.{decimals}f}"
    if float(text.replace(",", "")) == 0.0:
        text = text.lstrip("-")
    return text.replace("-", "−").replace(",", THIN)


def significant(value: float | None, digits: int = 3) -> str:
    """With a count of significant digits; beyond 1e6 or below 1e-4 as a power of ten."""
    if value is None or not math.isfinite(value):
        return MISSING
    if value == 0.0:
        return "0"
    exponent = math.floor(math.log10(abs(value)))
    if exponent >= 6 or exponent < -4:
        mantissa = number(value / 10.0**exponent, digits - 1)
        return f"{mantissa}{THIN}×{THIN}10{_superscript(exponent)}"
    return number(value, max(0, digits - 1 - exponent))


def with_deviation(value: float, deviation: float | None, digits: int = 2) -> str:
    """A value with as many decimals as its standard deviation supports (`digits` significant ones of it)."""
    if not _given(deviation) or not deviation:
        return significant(value, 4)
    decimals = digits - 1 - math.floor(math.log10(abs(deviation)))
    return number(value, min(max(decimals, 0), 8))


def percent(fraction: float | None, digits: int = 3) -> str:
    """A fraction as percent: 0.0733 is `7.33 %`; at least two decimals are kept below 10 %."""
    if fraction is None or not math.isfinite(fraction):
        return MISSING
    return f"{percent_number(fraction, digits)}{THIN}%"


def percent_number(fraction: float | None, digits: int = 3) -> str:
    """The number of `percent` without its sign; a dash where there is none."""
    if fraction is None or not math.isfinite(fraction):
        return MISSING
    value = 100.0 * fraction
    decimals = 2 if abs(value) < 10 else 1 if abs(value) < 100 else 0
    return number(value, max(0, decimals - (3 - digits)))


def probability(value: float | None) -> Markup:
    """A p-value as markup: an order of magnitude below 0.001, rather than a run of noise digits."""
    if value is None or not math.isfinite(value):
        return Markup(MISSING)
    if value >= 1e-3:
        return Markup(significant(value, 2))
    exponent = max(math.ceil(math.log10(value)) if value > 0 else -12, -12)
    return Markup(f"<{THIN}10<sup>{number(exponent, 0)}</sup>".replace("<" + THIN, "&lt;" + THIN))


def certainty(value: float | None) -> str:
    """A probability as percent; never 0 or 100 %, which no finite record supports."""
    if value is None or not math.isfinite(value):
        return MISSING
    whole = round(100.0 * value)
    return f"<{THIN}1{THIN}%" if whole < 1 else f">{THIN}99{THIN}%" if whole > 99 else f"{whole}{THIN}%"


def equation(text: str) -> Markup:
    """A formula of the catalogue with its subscripts (`_`) and superscripts (`^`) set."""
    safe = str(escape(text))
    safe = re.sub(r"_\{?([A-Za-z0-9+−,]+)\}?", r"<sub>\1</sub>", safe)
    return Markup(re.sub(r"\^\{?([A-Za-z0-9+−]+)\}?", r"<sup>\1</sup>", safe))


SYMBOLS = {
    "alpha": "α",
    "alpha_m": "α_m",
    "alpha_g": "α_g",
    "beta_difference": "β_m − β_g",
    "b_m": "b_m",
    "b_g": "b_g",
    "ripple_cos": "A",
    "ripple_sin": "B",
    "ripple_gain_cos": "A",
    "ripple_gain_sin": "B",
    "mass_ratio": "M_ae/M_aw",
    "gain_ratio": "M_ae/M_aw",
    "inertia_over_stiffness": "J/k",
    "compliance": "1/k",
    "delay": "δ",
}
"""Parameters, without the number of their joint, whose name is not their symbol in the equation of the effect -> symbol"""


def symbol(name: str) -> Markup:
    """The symbol of a parameter in its effect's equation; empty where the name itself says it."""
    return equation(SYMBOLS.get(re.sub(r"\d*(\[.*)?$", "", name), ""))


def unit(text: str | None) -> str:
    """A unit as it is printed: `kg m^2` is `kg m²`, a pure number has none."""
    return "" if text == "1" else (text or "").replace("^2", "²").replace("^3", "³")


def duration(seconds: float | None) -> str:
    """`42 s`, `3 min 05 s`, `1 h 02 min`."""
    if seconds is None or not math.isfinite(seconds):
        return MISSING
    whole = max(0, round(seconds))
    if whole < 60:
        return f"{whole}{THIN}s"
    if whole < 3600:
        return f"{whole // 60}{THIN}min {whole % 60:02d}{THIN}s"
    return f"{whole // 3600}{THIN}h {whole % 3600 // 60:02d}{THIN}min"


def moment(value: datetime | str | None) -> str:
    """A time stamp to the minute, in UTC and saying so; a text is read as ISO 8601."""
    if value is None or value == "":
        return MISSING
    when = datetime.fromisoformat(value) if isinstance(value, str) else value
    when = when.replace(tzinfo=UTC) if when.tzinfo is None else when.astimezone(UTC)
    return when.strftime("%Y-%m-%d %H:%M UTC")


def listing(parts: Iterable[str], last: str = "and") -> str:
    """`a`, `a and b`, `a, b and c`; `a; b, more than c; and d` where a part has a comma of its own."""
    items = list(parts)
    if len(items) < 2:
        return "".join(items)
    if any("," in item for item in items):
        return f"{'; '.join(items[:-1])}; {last} {items[-1]}"
    return f"{', '.join(items[:-1])} {last} {items[-1]}"


def _superscript(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def utc_time(seconds: float | None) -> datetime | None:
    """Seconds since 1970 as a time that the templates print."""
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC)


def with_commands(text: str) -> Markup:
    """A message in which `a command` between backticks stands in the typeface of commands."""
    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", str(escape(text))))
