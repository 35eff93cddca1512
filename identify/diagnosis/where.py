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
    striking variable first; contract section 3, key `where`."""
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
    best, best_range, run, start = 0.0, (0, 0), 0.0, 0
    for index, value in enumerate(excess):
        if run <= 0:
            run, start = 0.0, index
        run += float(value)
        if run > best:
            best, best_range = run, (start, index + 1)
    if best_range[1] == 0:
        return None
    low, high = best_range
    return Where(
        variable=name,
        from_=float(edges[low]),
        to=float(edges[high]),
        share_of_error=float(error[low:high].sum()),
        share_of_samples=float(samples[low:high].sum()),
        excess=best,
    )


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
