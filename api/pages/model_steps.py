"""The steps of a model: the staircase of its versions, and the addresses of the steps that a page offers."""

from pathlib import Path
from urllib.parse import urlencode

from markupsafe import Markup

from api.pages.effect_motion import motion_of_step
from api.pages.figures.step_chart import ModelStep, draw_step_chart
from api.pages.layout import experiment_link
from api.pages.motion_table import figure
from api.pages.stored_models import StoredExperiment
from api.service.model_use import SIMULATION_FILE
from identify.recording.errors import InputError
from identify.results.reading import read_document
from identify.results.simulation import SimulationDocument


def step_chart(stored: StoredExperiment, joint: str, floor: float | None) -> Markup:
    """The staircase of one joint: the versions that stand, then those that were undone."""
    steps = []
    before = None
    data = stored.story.current.fit.data if stored.story.current else ""
    for identifier in stored.story.shown:
        model = stored.model(identifier)
        part = model.joint(joint)
        if part.relative_error is None:
            continue  # nothing was measured on this joint
        motion, worse = _motion(model.folder, joint)
        if before is not None:
            added = set(model.version.add) - set(before.version.add)
            by_step, hurts = motion_of_step(stored.models.diagnosis(before.version.id), added, joint)
            motion, worse = motion or by_step, worse or hurts
        before = model
        steps.append(
            ModelStep(
                label=model.words.replace(f"@{joint}", ""),
                relative_error=part.relative_error,
                relative_error_validation=part.relative_error_validation,
                undone=identifier in stored.story.undone,
                current=identifier == stored.story.line[-1],
                other_data=None
                if model.version.fit.data == data
                else _sessions_words(model.version.fit.sessions),
                motion=motion,
                motion_worse=worse,
            )
        )
    return draw_step_chart(steps, floor)


def _sessions_words(sessions: int) -> str:
    return f"of {sessions} session" + ("s" if sessions != 1 else "")


def _motion(folder: Path, joint: str) -> tuple[str | None, bool]:
    """Error of position a second ahead on unseen motion, of the fit in that folder, and whether it is worse than the usual
    model's."""
    try:
        unseen = read_document(SimulationDocument, folder / SIMULATION_FILE).unseen
    except (FileNotFoundError, InputError):  # damaged figures are said on the model's own page
        return None, False
    if unseen is None:
        return None, False
    of_joint = next(each for each in unseen.joints if each.joint == joint)
    return figure(of_joint.position_rms, of_joint.unit), of_joint.worse


def step_link(stored: StoredExperiment, step: str, joint: str, **further: str) -> str:
    """Address to which a page posts a step of the model (`add`, `remove`, `undo` …), with further parts of the query."""
    return f"{experiment_link(stored.id, 'steps')}/{step}?{urlencode({'joint': joint, **further})}"
