"""Where the model fails: the share of the error by speed, position, load and the rest."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.structure import variable
from identify.estimation.prediction import Prediction
from identify.results.diagnosis import Where

Array = NDArray[np.float64]

BINS = 12
VARIABLES = ("dq", "q", "ddq", "load", "time", "travel since reversal", "temperature")


def where_it_fails(predictions: Sequence[Prediction]) -> tuple[Where, ...]:
    """For every variable the range that holds more of the squared error than its share of the samples, the most
    striking variable first; contract section 3, key `where`.

    Of the time it is the range of all sessions or the stretch of one, whichever holds more.
    """
    residual = np.concatenate([part.residual[part.moving] for part in predictions])
    power = residual**2
    total = float(power.sum())
    if total <= 0:
        return ()
    ranges = []
    for name in VARIABLES:
        if name == "temperature" and any(part.temperature is None for part in predictions):
            continue
        values = np.concatenate([variable(part, name)[part.moving] for part in predictions])
        row = _worst_range(name, values, residual, total)
        if name == "time":
            row = max(
                [row, *(_worst_stretch(part, total, len(residual)) for part in predictions)],
                key=lambda each: each.excess if each is not None else 0.0,
            )
        if row is not None:
            ranges.append(row)
    worst = _worst_session(predictions, total)
    if worst is not None:
        ranges.append(worst)
    return tuple(sorted(ranges, key=lambda row: row.excess, reverse=True))


def _worst_range(name: str, values: Array, residual: Array, total: float) -> Where | None:
    """The run of bins, of equal numbers of samples, in which the error exceeds its share the most."""
    edges = np.unique(np.quantile(values, np.linspace(0, 1, BINS + 1)))
    if len(edges) < 4:
        return None
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    error = np.bincount(place, residual**2, len(edges) - 1) / total
    samples = np.bincount(place, minlength=len(edges) - 1) / len(values)
    excess = error - samples
    low, high = _largest_run(excess)
    if high == 0:
        return None
    return Where(
        variable=name,
        from_=float(edges[low]),
        to=float(edges[high]),
        share_of_error=float(error[low:high].sum()),
        share_of_samples=float(samples[low:high].sum()),
        excess=float(excess[low:high].sum()),
    )


def _worst_stretch(part: Prediction, total: float, count: int) -> Where | None:
    """The stretch of one session in which the error exceeds its share the most: what happened once, such as a blow, comes back
    neither at the same time of another session nor at the same position.

    total : squared error of all sessions
    count : of their samples

    Its limits are times as they are recorded, where an operator looks for them.
    """
    time = part.time[part.moving]
    error = part.residual[part.moving] ** 2 / total
    low, high = _largest_run(error - 1 / count)
    if high == 0:
        return None
    return Where(
        variable="time",
        from_=float(time[low]),
        to=float(time[high - 1]),
        label=part.file,
        share_of_error=float(error[low:high].sum()),
        share_of_samples=(high - low) / count,
        excess=float(error[low:high].sum()) - (high - low) / count,
    )


def _largest_run(excess: Array) -> tuple[int, int]:
    """The run of elements with the largest sum, and (0, 0) where none has one above zero."""
    sums = np.concatenate([[0.0], np.cumsum(excess)])
    lowest = np.minimum.accumulate(sums)
    high = int(np.argmax(sums - lowest))
    return (int(np.argmin(sums[: high + 1])), high) if sums[high] > lowest[high] else (0, 0)


def _worst_session(predictions: Sequence[Prediction], total: float) -> Where | None:
    """The session whose share of the error exceeds its share of the samples the most; None where there is one only."""
    if len(predictions) < 2:
        return None
    errors = [float(np.sum(part.residual[part.moving] ** 2)) / total for part in predictions]
    samples = np.array([part.moving.sum() for part in predictions], float)
    samples /= max(samples.sum(), 1.0)
    worst = int(np.argmax(np.array(errors) - samples))
    return Where(
        variable="session",
        from_=worst,
        to=worst,
        label=predictions[worst].file,
        share_of_error=errors[worst],
        share_of_samples=float(samples[worst]),
        excess=errors[worst] - float(samples[worst]),
    )
