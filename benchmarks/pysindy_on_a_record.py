"""PySINDy on an experiment of ours: what `diagnosis_speed.py` runs and times.

    python pysindy_on_a_record.py EXPERIMENT_FOLDER

The torque is linear in a library of terms of the motion, which is PySINDy's problem with the torque in the place of the
derivative. The library is that of `refit_per_candidate.py` with every value of every constant a term of its own; sequential
thresholded least squares keeps few of them. The threshold is the one of the least error on tenths of the sessions left out.
Needs pysindy, SciPy and PyYAML, nothing of ours. Prints one JSON document as its last line.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pysindy
from refit_per_candidate import DECIMATION_CUTOFF, FOLDS, candidates, known_load, signals, usual
from scipy.signal import butter, filtfilt

THRESHOLDS = (0.003, 0.01, 0.03, 0.1, 0.3)
"""of terms scaled to unit norm, as parts of the torque's norm"""
BASE = ("inertia", "gravity cos", "gravity sin", "viscous", "coulomb", "offset", "payload")


def main(folder: Path) -> None:
    """Fit the library sparsely and print the terms that stay."""
    sessions, period = signals(folder)
    step = max(1, int(1 / (period * 8 * DECIMATION_CUTOFF)))
    low_pass = butter(4, 2 * DECIMATION_CUTOFF * period)
    names: list[str] = []
    tables, targets, folds = [], [], []
    for s in sessions:
        carried = known_load(s) + 12.0 * s["ddq"] + 88.0 * np.cos(s["q"])
        terms = [(name, column) for name, column in zip(BASE, usual(s).T, strict=True)]
        terms += [(name, column) for name, columns in candidates(s, carried) for column in columns.T]
        names = [name for name, _ in terms]
        whole = np.column_stack([*(column for _, column in terms), s["torque"]])
        kept = filtfilt(*low_pass, whole, axis=0)[::step][5:-5]
        tables.append(kept[:, :-1])
        targets.append(kept[:, -1])
        folds.append(np.arange(len(kept)) * FOLDS // len(kept))
    table, target, fold = np.concatenate(tables), np.concatenate(targets), np.concatenate(folds)
    size = np.linalg.norm(table, axis=0)
    there = size > 0  # a hat over a range that the joint does not reach is zero throughout
    names = [name for name, kept in zip(names, there, strict=True) if kept]
    table = table[:, there] / size[there]
    target = target / np.linalg.norm(target)

    def fitted(rows: np.ndarray, threshold: float) -> pysindy.SINDy:
        model = pysindy.SINDy(
            optimizer=pysindy.STLSQ(threshold=threshold, alpha=1e-6),
            feature_library=pysindy.IdentityLibrary(),
        )
        return model.fit(table[rows], t=1.0, x_dot=target[rows][:, None])

    def held_out(threshold: float) -> float:
        error = 0.0
        for left_out in range(FOLDS):
            rows = fold != left_out
            chosen = fitted(rows, threshold).coefficients()[0]
            error += float(np.sum((target[~rows] - table[~rows] @ chosen) ** 2))
        return error

    best = min(THRESHOLDS, key=held_out)
    chosen = fitted(np.ones(len(target), bool), best).coefficients()[0]
    order = np.argsort(-np.abs(chosen))
    kept_names = list(dict.fromkeys(names[k] for k in order if chosen[k] and names[k] not in BASE))
    print(json.dumps({"terms": kept_names, "threshold": best}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
