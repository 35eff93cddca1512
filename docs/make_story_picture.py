"""The README's picture: the error over model versions, and the residual over the effects' own variables.

    PYTHONPATH=. python docs/make_story_picture.py DEMO_EXPERIMENT

DEMO_EXPERIMENT is the experiment that `coulomb demo --out DIR` leaves in DIR/experiments/demo.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import identify
from identify.diagnosis.improvement import Step
from identify.estimation.prediction import predict

INK, GREEN, ORANGE, VIOLET = "#1b1f23", "#0b6e5a", "#d9580d", "#5b4bb0"


def residual(step: Step) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and residual of the identification sessions."""
    parts = [predict(step.fitted, entry)[0] for entry in step.fitted.entries]
    moving = np.concatenate([part.moving for part in parts])
    velocity = np.concatenate([part.velocity for part in parts])[moving]
    return velocity, np.concatenate([part.residual for part in parts])[moving]


def main() -> None:
    """Draw docs/story.png."""
    story = identify.improve(identify.load_experiment(sys.argv[1]))
    plt.rcParams.update(
        {"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "text.color": INK}
    )
    widths = [1.25] + [1.0] * len(story.steps)
    figure, axes = plt.subplots(
        1, len(widths), figsize=(11.5, 3.0), layout="constrained", gridspec_kw={"width_ratios": widths}
    )
    errors = [100 * step.relative_error for step in story.steps]
    names = ["usual" if step.added is None else f"+ {step.added.effect.name}" for step in story.steps]
    axes[0].step(range(len(errors)), errors, where="mid", color=GREEN, lw=1.6)
    axes[0].plot(errors, "o", color=GREEN, ms=5)
    for index, error in enumerate(errors):
        axes[0].annotate(f"{error:.2f} %", (index, error), xytext=(4, 6), textcoords="offset points")
    axes[0].set(
        ylim=(0, 1.2 * errors[0]), xticks=range(len(errors)), title="relative error over model versions"
    )
    axes[0].set_xticklabels([name.replace("-friction-", "-\nfriction-\n") for name in names], fontsize=7.5)
    largest = max(float(np.abs(residual(step)[1]).max()) for step in story.steps)
    for place, (step, name) in enumerate(zip(story.steps, names, strict=True), start=1):
        velocity, left = residual(step)
        axes[place].plot(velocity, left, ".", color=VIOLET, ms=1.2, alpha=0.4)
        axes[place].axhline(0, color=INK, lw=0.6)
        axes[place].set(ylim=(-largest, largest), xlabel="velocity, rad/s", title=name)
    axes[1].set_ylabel("measured − predicted, N m")
    figure.savefig(Path(__file__).with_name("story.png"), dpi=110)


if __name__ == "__main__":
    main()
