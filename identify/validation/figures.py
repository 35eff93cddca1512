"""Figures of a direct validation: measured and predicted torque and their difference (Fig. 4 and 5), and where the
error sits."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.estimation.prediction import Prediction

Array = NDArray[np.float64]

FORMATS = ("png", "svg")
BINS = 24
FEWEST_IN_BIN = 4
"""samples; fewer give no mean square worth drawing"""
LARGEST_DRAWN = 6000
"""samples of a course; more cannot be told apart on a page and make a vector file large"""
VARIABLES = (("velocity", "speed"), ("position", "position"), ("load", "load τ_out"))


def draw_course(predictions: Sequence[Prediction], title: str, revolute: Sequence[bool]) -> Any:
    """Measured, predicted and error over time, one row for each joint: Fig. 4 and 5 of the paper."""
    figure, axes = _figure(len(predictions), 1)
    for prediction, turns, (axis,) in zip(predictions, revolute, axes, strict=True):
        step = max(1, len(prediction.time) // LARGEST_DRAWN)
        time = prediction.time[::step]
        axis.plot(time, prediction.measured[::step], label="measured", color="black", linewidth=0.9)
        axis.plot(time, prediction.predicted[::step], label="predicted", color="tab:blue", linewidth=0.9)
        axis.plot(time, prediction.residual[::step], label="error", color="tab:red", linewidth=0.9)
        axis.set_ylabel(f"{prediction.joint}: torque, N m" if turns else f"{prediction.joint}: force, N")
        axis.set_title(f"relative error {100 * prediction.relative_error:.2f} %", fontsize=9, loc="right")
        axis.grid(alpha=0.3)
    axes[0][0].legend(loc="upper left", ncols=3, fontsize=8)
    axes[0][0].set_title(title, fontsize=10, loc="left")
    axes[-1][0].set_xlabel("time, s")
    return figure


def draw_where(models: dict[str, list[list[Prediction]]], revolute: Sequence[bool]) -> Any:
    """Root mean square error over speed, position and load, one row for each joint, one line for each model.

    models : name -> for every joint its predictions in all sessions
    """
    joints = len(revolute)
    figure, axes = _figure(joints, len(VARIABLES))
    for joint in range(joints):
        for column, (variable, label) in enumerate(VARIABLES):
            axis = axes[joint][column]
            for name, predictions in models.items():
                centre, error = error_over(predictions[joint], variable)
                axis.step(centre, error, where="mid", label=name, linewidth=1.1)
            axis.grid(alpha=0.3)
            axis.set_ylim(bottom=0)
            axis.set_xlabel(f"{label}, {_unit(variable, revolute[joint])}", fontsize=8)
            axis.tick_params(labelsize=8)
        name = next(iter(models.values()))[joint][0].joint
        axes[joint][0].set_ylabel(f"{name}: rms error, {'N m' if revolute[joint] else 'N'}", fontsize=8)
    axes[0][0].legend(fontsize=8)
    return figure


def error_over(predictions: Sequence[Prediction], variable: str) -> tuple[Array, Array]:
    """Centres of bins of a variable and the root mean square error in each, NaN where there are too few samples."""
    moving = [prediction.moving for prediction in predictions]
    values = np.concatenate(
        [getattr(prediction, variable)[on] for prediction, on in zip(predictions, moving, strict=True)]
    )
    residual = np.concatenate(
        [prediction.residual[on] for prediction, on in zip(predictions, moving, strict=True)]
    )
    if not len(values) or np.ptp(values) == 0:
        return np.zeros(0), np.zeros(0)
    edges = np.linspace(values.min(), values.max(), BINS + 1)
    place = np.clip(np.digitize(values, edges) - 1, 0, BINS - 1)
    count = np.bincount(place, minlength=BINS)
    squares = np.bincount(place, weights=residual**2, minlength=BINS)
    error = np.sqrt(squares / np.maximum(count, 1))
    return 0.5 * (edges[1:] + edges[:-1]), np.where(count >= FEWEST_IN_BIN, error, np.nan)


def save(figure: Any, folder: Path, name: str) -> list[str]:
    """Write a figure in every format; returns the files' names."""
    files = [f"{name}.{kind}" for kind in FORMATS]
    for file in files:
        # a fixed salt and no date: the same result gives the same file
        figure.savefig(folder / file, dpi=130, metadata={"Date": None} if file.endswith(".svg") else None)
    return files


def _figure(rows: int, columns: int) -> tuple[Any, list[list[Any]]]:
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    mpl.rcParams["svg.hashsalt"] = "coulomb"
    figure = Figure(figsize=(9.5, 1.2 + 2.2 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False).tolist()


def _unit(variable: str, revolute: bool) -> str:
    if variable == "load":
        return "N m" if revolute else "N"
    length = "rad" if revolute else "m"
    return length if variable == "position" else f"{length}/s"
