"""What every figure is drawn with: linear scales, round ticks, and SVG elements as text.

Lengths are SVG user units (pixels at the nominal width). Text and colours are classes of `figures.css`.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import ArrayLike

from api.pages.number_format import number


@dataclass(frozen=True)
class Scale:
    """A linear map from data (`low`..`high`) to pixels (`start`..`end`); `start` may be the larger."""

    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
        return self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start)

    def array(self, values: ArrayLike) -> np.ndarray:
        """Pixels of many values at once, in their shape."""
        return self.start + (np.asarray(values, float) - self.low) / (self.high - self.low) * (
            self.end - self.start
        )


def round_ticks(low: float, high: float, about: int = 5) -> list[float]:
    """Ticks at 1, 2 or 5 times a power of ten inside [low, high], `about` as many as asked for."""
    if not (math.isfinite(low) and math.isfinite(high)) or high <= low:
        return []
    raw = (high - low) / max(about, 1)
    power = 10.0 ** math.floor(math.log10(raw))
    step = power * next(m for m in (1, 2, 5, 10) if m * power >= raw * 0.999)
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [index * step if index else 0.0 for index in range(first, last + 1)]


def tick_text(value: float, ticks: Sequence[float]) -> str:
    """A tick's label, with as many decimals as the spacing of the ticks needs and a true minus sign."""
    step = abs(ticks[1] - ticks[0]) if len(ticks) > 1 else abs(value) or 1.0
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    return number(value, decimals)


def padded_range(values: ArrayLike, share: float = 0.06, include_zero: bool = False) -> tuple[float, float]:
    """The finite range of `values`, widened by `share` to either side; never empty."""
    finite = np.asarray(values, float)
    finite = finite[np.isfinite(finite)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    if include_zero:
        low, high = min(low, 0.0), max(high, 0.0)
    if high <= low:
        margin = abs(high) * 0.1 or 1.0
    else:
        margin = (high - low) * share
    return low - margin, high + margin


def element(name: str, content: str = "", **attributes: object) -> str:
    """One SVG element; `class_` gives the class, an underscore stands for a hyphen, None leaves an attribute out."""
    parts = [name]
    for key, value in attributes.items():
        if value is None:
            continue
        text = f"{value:.1f}".removesuffix(".0") if isinstance(value, float) else str(value)
        parts.append(f'{key.rstrip("_").replace("_", "-")}="{escape(text)}"')
    head = " ".join(parts)
    return f"<{head}>{content}</{name}>" if content else f"<{head}/>"


def text(x: float, y: float, label: str, class_: str = "", **attributes: object) -> str:
    """One line of text at (x, y) in pixels; its characters are escaped."""
    return element("text", str(escape(label)), x=float(x), y=float(y), class_=class_ or None, **attributes)


def line(x1: float, y1: float, x2: float, y2: float, class_: str) -> str:
    """A straight line between two points in pixels."""
    return element("line", x1=float(x1), y1=float(y1), x2=float(x2), y2=float(y2), class_=class_)


class _Tenths(dict[int, str]):
    """Whole tenths of a pixel as a path spells them behind another number: ` 12`, ` .3`, `-1.2`."""

    def __missing__(self, tenths: int) -> str:
        whole, rest = divmod(abs(tenths), 10)
        digits = f"{whole or ''}.{rest}" if rest else str(whole)
        spelled = f"-{digits}" if tenths < 0 else f" {digits}"
        if len(self) < MOST_SPELLED:
            self[tenths] = spelled
        return spelled


MOST_SPELLED = 20_000
_TENTHS = _Tenths()


def path_data(x: ArrayLike, y: ArrayLike) -> str:
    """Path data of a polyline, to a tenth of a pixel; a point that is not finite breaks it. (A page has few bytes: points are
    told by the way from the one before.)"""
    points = np.stack([np.asarray(x, float), np.asarray(y, float)], axis=1)
    pieces = []
    for run in _runs(np.isfinite(points[:, 0]) & np.isfinite(points[:, 1])):
        tenths = np.rint(10.0 * np.clip(points[run], -1e8, 1e8)).astype(int)
        begin, ways = tenths[0].tolist(), np.diff(tenths, axis=0).ravel().tolist()
        pieces.append("M" + "".join([_TENTHS[each] for each in begin]).lstrip())
        if ways:
            pieces.append("l" + "".join([_TENTHS[each] for each in ways]).lstrip())
    return "".join(pieces)


def curve(x: ArrayLike, y: ArrayLike, class_: str) -> str:
    """A polyline through (N,) points in pixels, broken where one is not finite; empty where none is left."""
    data = path_data(x, y)
    return element("path", d=data, class_=class_) if data else ""


def area(x: ArrayLike, lower: ArrayLike, upper: ArrayLike, class_: str) -> str:
    """The band between two curves; broken where either is not finite."""
    x, lower, upper = (np.asarray(values, float) for values in (x, lower, upper))
    finite = np.isfinite(x) & np.isfinite(lower) & np.isfinite(upper)
    data = []
    for run in _runs(finite):
        edge_x = np.concatenate([x[run], x[run][::-1]])
        edge_y = np.concatenate([upper[run], lower[run][::-1]])
        data.append(path_data(edge_x, edge_y) + "Z")
    return element("path", d="".join(data), class_=class_) if data else ""


def _runs(flags: np.ndarray) -> Iterable[slice]:
    """Slices of the consecutive true entries."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return (slice(start, stop) for start, stop in zip(edges[::2], edges[1::2], strict=True))


def picture(
    width: float, height: float, title: str, *content: str, axes: str | None = None, groups: str | None = None
) -> Markup:
    """The whole SVG; `title` is what a screen reader says, so it states what the figure shows.

    axes, groups : what `choosable` says of it, where a choice of samples is shown in it
    """
    data = (("axes", axes), ("groups", groups))
    attribute = "".join(f' data-{name}="{escape(value)}"' for name, value in data if value is not None)
    return Markup(
        f'<svg class="figure" viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{escape(title)}"{attribute}'
        f' xmlns="http://www.w3.org/2000/svg">{"".join(content)}</svg>'
    )
