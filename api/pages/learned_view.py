"""A description that is offered where the catalogue ends: its picture, its support points, and the way to add it."""

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from api.pages.error_figures import JointUnits
from api.pages.figures.error_band import ErrorBand, error_band
from api.pages.figures.learned_curve import LearnedCurve, draw_learned_curve
from api.pages.kept_numbers import KeptNumbers
from api.pages.model_steps import step_link
from api.pages.stored_models import ShownModel, StoredExperiment
from api.pages.verdict_words import VARIABLE_WORDS
from identify.results.diagnosis import JointDiagnosis, Learned

SAMPLES = {"q": "position", "dq": "speed", "load": "load", "time": "time", "temperature": "temperature"}
"""Variable of a description -> name of the samples' array that it runs over; others are positions of other joints."""
BANDS = 36
"""intervals of what the model leaves"""
_left: KeptNumbers[ErrorBand] = KeptNumbers("left", ErrorBand)


@dataclass(frozen=True)
class SupportPoint:
    """One row of the table; a deviation is None where it is not known."""

    at: float
    values: tuple[tuple[float, float | None], ...]


@dataclass(frozen=True)
class LearnedView:
    """What the page shows of a description.

    title : what its torque runs over, in words
    directions : heads of the columns of values: one, or backwards and forwards
    """

    learned: Learned
    title: str
    unit: str
    drawing: Markup
    directions: tuple[str, ...]
    points: list[SupportPoint]
    add_link: str


def learned_view(
    stored: StoredExperiment,
    shown: ShownModel,
    diagnosis: JointDiagnosis | None,
    joint: str,
    units: JointUnits,
) -> LearnedView | None:
    """The description that the diagnosis of a joint offers; None where it offers none."""
    learned = None if diagnosis is None else diagnosis.learned
    if learned is None:
        return None
    directed = len(learned.variables) > 1
    knots = np.array(learned.knots[0])
    shape = (len(knots), 2 if directed else 1)
    values = np.array(learned.values).reshape(shape)
    deviations = np.array([np.nan if each is None else each for each in learned.deviations]).reshape(shape)
    kinds = ("predicted", "") if directed else ("",)
    curves = [
        LearnedCurve(knots, values[:, place], deviations[:, place], kind) for place, kind in enumerate(kinds)
    ]
    title, unit = _variable(stored, learned.variables[0], units)
    return LearnedView(
        learned=learned,
        title=title,
        unit=unit,
        drawing=draw_learned_curve(
            curves, None if directed else _left_over(stored, shown, joint, learned), title, unit, learned.unit
        ),
        directions=("backwards", "forwards") if directed else ("",),
        points=[
            SupportPoint(at, tuple(zip(row, _known(deviation), strict=True)))
            for at, row, deviation in zip(knots.tolist(), values.tolist(), deviations.tolist(), strict=True)
        ],
        add_link=step_link(stored, "add-learned", joint),
    )


def _known(deviations: list[float]) -> list[float | None]:
    return [each if np.isfinite(each) else None for each in deviations]


def _variable(stored: StoredExperiment, name: str, units: JointUnits) -> tuple[str, str]:
    """The variable in words, and its unit."""
    if name in VARIABLE_WORDS:
        title, dimension = VARIABLE_WORDS[name]
        return ("magnitude of the speed" if name == "dq" else title), units.of_dimension(dimension)
    other = stored.declared.robot.joints[int(name.removeprefix("q")) - 1]
    return f"position of {other.name}", JointUnits.of(other.type).position


def _left_over(stored: StoredExperiment, shown: ShownModel, joint: str, learned: Learned) -> ErrorBand | None:
    """What the model leaves over the variable; None over the position of another joint."""
    name = SAMPLES.get(learned.variables[0])
    if name is None:
        return None
    files = stored.fitted_files(shown)
    edges = np.linspace(learned.knots[0][0], learned.knots[0][-1], BANDS + 1)

    def band() -> ErrorBand:
        samples = stored.figure_samples(shown, joint, files).in_fit
        return error_band(getattr(samples, name), samples.error, edges)

    return _left.of(shown.folder, [joint, files, name, edges.tolist()], band)
