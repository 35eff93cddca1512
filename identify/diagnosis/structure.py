"""Is what is left noise? Several questions to the residual, each answered on motion that the answer did not see."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.deciding_constants import (
    FEWEST_FOLDS,
    LEAST_SHARE,
    SIGNIFICANCE,
    STANDS_OUT,
    STRETCHES,
)
from identify.diagnosis.disturbance import (
    PredictableShare,
    least_remembered,
    remembered,
    strong_runs,
)
from identify.estimation import forked
from identify.estimation.prediction import Prediction

Array = NDArray[np.float64]

NEIGHBOURS = 16
"""samples whose mean predicts another one; their noise adds a sixteenth of its power to the prediction's error"""
MOST_SAMPLES = 20_000
HISTORY = 1.5
"""s of the past that a hidden state of a joint may remember"""
LAGS = 24
HISTORY_RIDGE = 1e-3
LINE_BAND = 7
"""frequency bins that a line may be wide, its modulation included"""
LINE_NEIGHBOURHOOD = 40
"""bins to either side that a line must stand out from"""
SHORTEST_SPECTRUM = 4 * LINE_NEIGHBOURHOOD
"""samples"""


@dataclass(frozen=True)
class Structure:
    """How much of a residual's power a predictor without any model explains on motion that it did not see.

    variables : what it was predicted from
    share     : part of the power explained, negative where the prediction is worse than none
    deviation : standard error of the share over the folds
    least     : share below which it is called noise
    """

    variables: tuple[str, ...]
    share: float
    deviation: float
    least: float = field(default_factory=lambda: LEAST_SHARE)

    @property
    def found(self) -> bool:
        """Whether there is structure."""
        return self.share > self.least and self.certain

    @property
    def certain(self) -> bool:
        """Whether the share is more than its scatter over the folds makes of noise in one of so many questions."""
        from scipy.special import ndtri

        return bool(self.share > -ndtri(SIGNIFICANCE / len(QUESTIONS)) * self.deviation)


VIEWS: tuple[tuple[str, ...], ...] = (
    ("q", "dq", "ddq"),
    ("q", "dq", "load"),
    ("dq", "load"),
    ("q", "direction"),
    ("travel since reversal", "dq"),
    ("time", "dq"),
)


def leftover_structure(predictions: Sequence[Prediction]) -> list[Structure]:
    """Predict the residual of a joint from several sets of variables; the most telling first.

    Beside the neighbours in sets of variables: the history of the motion (a hidden state, such as something that
    swings along), a line in the spectrum over time (something that shakes without regard to the motion), and
    disturbances that come and go whatever the motion does (`disturbance.py`).
    """
    return leftover_structures([predictions])[0]


def leftover_structures(joints: Sequence[Sequence[Prediction]]) -> list[list[Structure]]:
    """The same for several joints, base to tip, each of which is also asked beside its neighbours; the questions are divided
    among processes."""
    cut = [bounded(predictions) for predictions in joints]
    beside = len(QUESTIONS)
    asked = [
        (joint, question)
        for joint in range(len(joints))
        for question in range(beside if len(joints) == 1 else beside + 1)
    ]

    def answer(place: tuple[int, int]) -> Structure:
        joint, question = place
        if question == beside:
            return _from_neighbouring_joints(
                cut[joint], cut[max(joint - 1, 0) : joint], cut[joint + 1 : joint + 2]
            )
        return QUESTIONS[question](cut[joint], joints[joint])

    answers = forked.each(answer, asked)
    return [
        sorted(
            (structure for (place, _), structure in zip(asked, answers, strict=True) if place == joint),
            key=lambda structure: structure.share,
            reverse=True,
        )
        for joint in range(len(joints))
    ]


def _as_structure(view: tuple[str, ...], predictable: PredictableShare, least: float) -> Structure:
    return Structure(view, predictable.share, predictable.deviation, least)


def bounded(predictions: Sequence[Prediction]) -> list[Prediction]:
    """The same with residuals cut where they stand out of noise: some samples beside a stop or a reversal are not structure."""
    residual = np.concatenate([part.residual[part.moving] for part in predictions])
    bound = STANDS_OUT * 1.4826 * float(np.median(np.abs(residual))) if len(residual) else 0.0
    return [
        replace(part, predicted=part.measured - np.clip(part.residual, -bound, bound)) for part in predictions
    ]


def variable(prediction: Prediction, name: str) -> Array:
    """A variable of the motion by name, (samples,)."""
    if name == "q":
        return prediction.position
    if name == "dq":
        return prediction.velocity
    if name == "ddq":
        return prediction.acceleration
    if name == "load":
        return prediction.load
    if name == "torque":
        return prediction.predicted
    if name == "direction":
        return np.sign(prediction.velocity)
    if name == "time":
        return prediction.time - prediction.time[0]
    if name == "travel since reversal":
        return travel_since_reversal(prediction.position, prediction.velocity)
    if name == "temperature" and prediction.temperature is not None:
        return prediction.temperature
    raise KeyError(name)


def travel_since_reversal(position: Array, velocity: Array) -> Array:
    """Way since the velocity last changed its sign, rad or m, with the sign of the motion."""
    direction = np.sign(velocity)
    turn = np.concatenate([[True], direction[1:] != direction[:-1]])
    start = np.maximum.accumulate(np.where(turn, np.arange(len(position)), 0))
    return position - position[start]


def _from_neighbouring_joints(
    predictions: Sequence[Prediction], *others: Sequence[Sequence[Prediction]]
) -> Structure:
    """Predict the residual from the speeds of a joint and of the one before or behind it, whichever tells more: friction in the
    sum or the difference of both, as of a motor or a belt that they share."""
    known = [joint for side in others for joint in side]
    return max((_predictable(predictions, ("dq",), joint) for joint in known), key=lambda each: each.share)


def _predictable(
    predictions: Sequence[Prediction], view: tuple[str, ...], other: Sequence[Prediction] | None = None
) -> Structure:
    """Predict the residual from samples that lie near in some variables, and in the speed of another joint if one is given."""
    from scipy.spatial import KDTree

    features, residual, fold = [], [], []
    for place, part in enumerate(predictions):
        moving = part.moving
        signals = [variable(part, name)[moving] for name in view]
        if other is not None:
            signals.append(other[place].velocity[moving])
        features.append(np.column_stack(signals))
        residual.append(part.residual[moving])
        count = int(moving.sum())
        stretches = 4 * STRETCHES if "time" in view else STRETCHES
        fold.append(np.arange(count) * stretches // max(count, 1) % STRETCHES)
    table, left, folds = np.concatenate(features), np.concatenate(residual), np.concatenate(fold)
    if other:
        view = (*view, f"dq of {other[0].joint}")
    if len(left) > MOST_SAMPLES:
        kept = slice(None, None, len(left) // MOST_SAMPLES + 1)
        table, left, folds = table[kept], left[kept], folds[kept]
    spread = np.maximum(np.std(table, axis=0), 1e-12)
    table = table / spread
    shares, weights = [], []
    for index in range(STRETCHES):
        test = folds == index
        if test.sum() < NEIGHBOURS or (~test).sum() < 4 * NEIGHBOURS:
            continue
        tree = KDTree(table[~test])
        _, near = tree.query(table[test], k=NEIGHBOURS, workers=1)
        guess = left[~test][near].mean(axis=1)
        power = float(left[test] @ left[test])
        if power <= 0:
            continue
        remaining = float(np.sum((left[test] - guess) ** 2))
        shares.append(1 - remaining / power)
        weights.append(power)
    if len(shares) <= FEWEST_FOLDS:
        return Structure(view, 0.0, np.inf)
    share = float(np.average(shares, weights=weights))
    return Structure(view, share, float(np.std(shares, ddof=1) / np.sqrt(len(shares))))


def _from_history(predictions: Sequence[Prediction]) -> Structure:
    """Predict the residual linearly from the accelerations and directions of the last `HISTORY` seconds."""
    tables, residuals, folds = [], [], []
    for part in predictions:
        step = float(np.median(np.diff(part.time)))
        lags = np.unique(np.round(np.linspace(0, HISTORY / step, LAGS)).astype(int))
        signals = [part.acceleration, np.sign(part.velocity)]
        rows = np.arange(len(part.time))
        whole = (rows >= lags[-1]) & part.moving
        if not whole.any():
            continue  # shorter than what is to be remembered
        whole[lags[-1] :] &= (
            np.abs(part.time[lags[-1] :] - part.time[: len(rows) - lags[-1]] - lags[-1] * step) < step
        )
        inside = rows[whole]
        tables.append(np.column_stack([signal[inside - lag] for signal in signals for lag in lags]))
        residuals.append(part.residual[inside])
        folds.append(np.arange(len(inside)) * STRETCHES // max(len(inside), 1))
    view = ("history",)
    if not tables:
        return Structure(view, 0.0, np.inf)
    width = min(table.shape[1] for table in tables)
    table = np.concatenate([part[:, :width] for part in tables])
    left, fold = np.concatenate(residuals), np.concatenate(folds)
    # What never changes (the direction of a motion that never turns round) predicts nothing.
    spread = np.std(table, axis=0)
    table = table[:, spread > 0] / spread[spread > 0]
    width = table.shape[1]
    if not width or len(left) < 10 * width:
        return Structure(view, 0.0, np.inf)
    shares, weights = [], []
    for index in range(STRETCHES):
        test = fold == index
        power = float(left[test] @ left[test])
        if power <= 0:
            continue
        train = table[~test]
        inner = train.T @ train + HISTORY_RIDGE * len(train) * np.eye(width)
        guess = table[test] @ np.linalg.solve(inner, train.T @ left[~test])
        shares.append(1 - float(np.sum((left[test] - guess) ** 2)) / power)
        weights.append(power)
    if len(shares) <= FEWEST_FOLDS:
        return Structure(view, 0.0, np.inf)
    share = float(np.average(shares, weights=weights))
    return Structure(view, share, float(np.std(shares, ddof=1) / np.sqrt(len(shares))))


def _line_over_time(predictions: Sequence[Prediction]) -> Structure:
    """Share of the residual's power in its strongest narrow band over time, beyond that of its neighbourhood.

    A resonance or slow noise is broad: the band must stand out from the bands beside it. What shakes whatever the
    motion does so all the time: the share is one that three quarters of the halves of sessions have at the same
    frequency. The steps of an encoder are a line too, at another frequency for every speed.
    """
    spectra = []
    for part in predictions:
        residual = np.where(part.moving, part.residual, 0.0)
        step = float(np.median(np.diff(part.time)))
        spectra += [
            _spectrum(half, step) for half in np.array_split(residual, 2) if len(half) >= SHORTEST_SPECTRUM
        ]
    if not spectra:
        return Structure(("frequency",), 0.0, np.inf)
    peaks = {spectrum.frequency[int(np.argmax(spectrum.share))] for spectrum in spectra}
    best = max(
        (np.array([spectrum.share_at(peak) for spectrum in spectra]) for peak in peaks),
        key=lambda shares: float(shares.min()),
    )
    spread = float(np.std(best, ddof=1) / np.sqrt(len(best))) if len(best) > 1 else 0.0
    return Structure(("frequency",), float(best.min()), spread)


@dataclass(frozen=True)
class _Spectrum:
    """Share of the power in the band around each frequency in Hz, 0 where the band does not stand out."""

    frequency: Array
    share: Array

    def share_at(self, frequency: float) -> float:
        """The largest share within a band of a frequency."""
        near = int(np.argmin(np.abs(self.frequency - frequency)))
        return float(self.share[max(0, near - LINE_BAND) : near + LINE_BAND + 1].max())


def _spectrum(residual: Array, step: float) -> _Spectrum:
    from scipy.ndimage import median_filter

    power = np.abs(np.fft.rfft(residual * np.hanning(len(residual)))) ** 2
    band = np.convolve(power, np.ones(LINE_BAND), "same")
    usual = LINE_BAND * np.asarray(median_filter(power, 2 * LINE_NEIGHBOURHOOD + 1)) / np.log(2)
    share = np.where(band > _line_stands_out(len(power)) * usual, band - usual, 0.0) / max(
        float(power.sum()), 1e-300
    )
    share[:LINE_BAND] = share[-LINE_BAND:] = 0.0
    return _Spectrum(np.asarray(np.fft.rfftfreq(len(residual), step), float), share)


def _line_stands_out(bins: int) -> float:
    """Times the usual power of its neighbourhood beyond which no band of white noise is but in one spectrum of a hundred.

    The power of a band is a sum of exponential variables, of which the correlations under Hann's window (2/3 between neighbours,
    1/6 between those after) leave fewer independent ones. The scatter of the neighbourhood's median comes to that: bands stand
    out in one spectrum of twenty, but with far less than `LEAST_SHARE` of the power.
    """
    from scipy.special import gammainccinv

    together = LINE_BAND + 2 * ((LINE_BAND - 1) * (2 / 3) ** 2 + (LINE_BAND - 2) * (1 / 6) ** 2)
    independent = LINE_BAND**2 / together
    return float(gammainccinv(independent, SIGNIFICANCE / max(bins, 1)) / independent)


def _from_neighbours(view: tuple[str, ...], cut: Sequence[Prediction], _: Sequence[Prediction]) -> Structure:
    return _predictable(cut, view)


QUESTIONS: tuple[Callable[[Sequence[Prediction], Sequence[Prediction]], Structure], ...] = (
    *(partial(_from_neighbours, view) for view in VIEWS),
    lambda cut, _: _from_history(cut),
    lambda cut, _: _line_over_time(cut),
    lambda cut, _: _as_structure(("time",), remembered(cut), least_remembered()),
    lambda cut, _: _as_structure(
        ("time", "direction"), remembered(cut, with_direction=True), least_remembered()
    ),
    lambda _, whole: _as_structure(("moments",), strong_runs(whole), LEAST_SHARE),
)
"""What is asked of a joint's predictions, residuals cut where they stand out of noise, and of the same as they are."""
