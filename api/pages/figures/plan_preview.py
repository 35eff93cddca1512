"""One signal of a planned motion against its limits: a line over time, the limits dashed, what exceeds them shaded."""

import numpy as np
from markupsafe import Markup

from api.pages.figures.drawing import (
    Scale,
    curve,
    element,
    line,
    padded_range,
    picture,
    round_ticks,
    text,
    tick_text,
)


def draw_plan_signal(
    time: np.ndarray,
    signal: np.ndarray,
    limits: tuple[float | None, float | None],
    label: str,
    unit: str,
    kind: str,
    width: float = 800,
    height: float = 142,
) -> Markup:
    """Draw `signal` (samples,) over `time` (samples,), s, with its lower and upper limit (None: there is none).

    `kind` is the class of the curve.
    """
    left, right, top, bottom = 52.0, width - 58.0, 10.0, height - 28.0
    time, signal = _thinned(time, signal)
    present = [limit for limit in limits if limit is not None]
    low, high = padded_range(np.concatenate([signal, np.asarray(present, float)]), 0.08)
    x = Scale(float(time[0]), float(time[-1]) or 1.0, left, right)
    y = Scale(low, high, bottom, top)
    content = []
    lower, upper = limits
    if upper is not None:
        content.append(
            element("rect", x=left, y=top, width=right - left, height=max(y(upper) - top, 0.0), class_="over")
        )
        content.append(line(left, y(upper), right, y(upper), "limit"))
        content.append(text(right + 6, y(upper) + 3.8, tick_label(upper), "limit-text"))
    if lower is not None:
        content.append(
            element(
                "rect",
                x=left,
                y=y(lower),
                width=right - left,
                height=max(bottom - y(lower), 0.0),
                class_="over",
            )
        )
        content.append(line(left, y(lower), right, y(lower), "limit"))
        content.append(text(right + 6, y(lower) + 3.8, tick_label(lower), "limit-text"))
    ticks = round_ticks(low, high, 3)
    content += [line(left, y(tick), right, y(tick), "grid-line") for tick in ticks]
    content += [text(left - 7, y(tick) + 3.8, tick_text(tick, ticks), "end") for tick in ticks]
    content.append(curve(x.array(time), y.array(signal), f"curve thin {kind}"))
    ticks = round_ticks(x.low, x.high, 8)
    content += [text(x(tick), bottom + 14, tick_text(tick, ticks), "middle") for tick in ticks]
    content.append(line(left, bottom, right, bottom, "axis"))
    content.append(text(right + 14, bottom + 14, "s", "faint"))
    middle = (top + bottom) / 2
    content.append(
        text(11, middle, f"{label}, {unit}", "middle title", transform=f"rotate(-90 11 {middle:g})")
    )
    return picture(width, height, f"Planned {label} against its limits", *content)


def tick_label(value: float) -> str:
    """A value with two significant digits, as ticks are written."""
    return tick_text(value, [0.0, 10.0 ** (np.floor(np.log10(abs(value))) - 1)] if value else [])


def _thinned(time: np.ndarray, signal: np.ndarray, buckets: int = 560) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest of each bucket, in their order, so that no peak is lost."""
    size = len(time) // buckets
    if size < 3:
        return time, signal
    whole = size * (len(time) // size)
    rows = signal[:whole].reshape(-1, size)
    first = np.arange(rows.shape[0]) * size
    picks = np.sort(np.stack([rows.argmin(1), rows.argmax(1)], 1), axis=1) + first[:, None]
    chosen = np.unique(np.concatenate([picks.ravel(), [0, len(time) - 1]]))
    return time[chosen], signal[chosen]
