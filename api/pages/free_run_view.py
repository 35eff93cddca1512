"""The free run on the model's page: each session's errors, and the motion of one of them over time."""

from dataclasses import dataclass
from urllib.parse import urlencode

from markupsafe import Markup

from api.pages.choices import ALL_SESSIONS
from api.pages.figures.free_run import FreeRun, draw_free_run
from api.pages.layout import experiment_link
from api.pages.motion_table import figure
from api.pages.number_format import significant
from api.pages.rendering import Context
from api.pages.stored_models import ShownModel, StoredExperiment
from api.service.model_use import ModelUse
from identify.recording.errors import InputError
from identify.results.simulation import JointMotionError, SimulationDocument


@dataclass(frozen=True)
class _Session:
    """One joint's free run in one session, and where the session stands in the list of the page."""

    file: str
    label: str
    errors: JointMotionError


def free_run_context(
    use: ModelUse, stored: StoredExperiment, shown: ShownModel, joint: str, session: str
) -> Context:
    """Context of the panel: of the session that the page shows, or of the one with the largest error where it shows all; empty
    where there is no free run."""
    try:
        document = use.simulation(stored.id, shown.version.id)
    except InputError:
        document = None  # said where its other figures stand
    sessions = [] if document is None else _sessions(document, stored, shown, joint)
    if not sessions:
        return {"free_run": None}
    drawn = next((each for each in sessions if each.file == session), None)
    if drawn is None:
        drawn = max(sessions, key=lambda each: each.errors.position_rms or 0.0)
    return {
        "free_run": {
            "figures": _figures(use, stored, shown, joint, drawn),
            "session": drawn.label,
            "chosen": session != ALL_SESSIONS,
            "several": len(sessions) > 1,
            "usual": any(each.errors.position_rms_usual is not None for each in sessions),
            "rows": [_row(each, each.file == drawn.file, stored, shown, joint) for each in sessions],
        }
    }


def _sessions(
    document: SimulationDocument, stored: StoredExperiment, shown: ShownModel, joint: str
) -> list[_Session]:
    """In the order of the page's tabs; sessions that came later at the end."""
    order = {file: place for place, file in enumerate(stored.fitted_files(shown), 1)}
    sessions: list[_Session] = []
    for horizon in document.horizons:
        for each in horizon.sessions if horizon.horizon is None else ():
            place = order.get(each.file)
            label = f"{place} · {each.payload}" if place else each.file
            if horizon.role == "validation":
                label += ", validation"
            errors = next(of for of in each.joints if of.joint == joint)
            sessions.append(_Session(each.file, label, errors))
    return sorted(sessions, key=lambda each: order.get(each.file, len(order) + 1))


@dataclass(frozen=True)
class FreeRunRow:
    """One session's free run: errors with their units, and when motion left the record, of the model and of the usual one."""

    words: str
    here: bool
    link: str
    error: str
    speed: str
    left: str
    usual: str
    usual_speed: str
    usual_left: str


@dataclass(frozen=True)
class FreeRunFigures:
    """The picture, and the same for a phone."""

    wide: Markup
    narrow: Markup


def _row(each: _Session, here: bool, stored: StoredExperiment, shown: ShownModel, joint: str) -> FreeRunRow:
    errors = each.errors
    query = urlencode({"joint": joint, "session": each.file, "version": shown.version.id})
    return FreeRunRow(
        words=each.label,
        here=here,
        link=f"{experiment_link(stored.id, 'model')}?{query}#free-run",
        error=figure(errors.position_rms, errors.unit),
        speed=figure(errors.velocity_rms, f"{errors.unit}/s"),
        left=_left(errors.left_record_at),
        usual=figure(errors.position_rms_usual, errors.unit),
        usual_speed=figure(errors.velocity_rms_usual, f"{errors.unit}/s"),
        usual_left=_left(errors.left_record_at_usual),
    )


def _left(at: float | None) -> str:
    return "never" if at is None else f"at {significant(at)} s"


def _figures(
    use: ModelUse, stored: StoredExperiment, shown: ShownModel, joint: str, drawn: _Session
) -> FreeRunFigures | None:
    """The picture, wide and for a phone; None where its curves were not kept."""
    try:
        curves = use.free_run(stored.id, shown.version.id, drawn.file, stored.joint_names.index(joint))
    except InputError:
        return None  # damaged, or of an earlier version: a picture that can be made again hides no page
    if curves is None:
        return None
    unit = drawn.errors.unit
    run = FreeRun(
        curves.time,
        curves.position,
        curves.speed,
        unit,
        f"m{unit}",
        drawn.errors.left_record_at,
        drawn.errors.left_record_at_usual,
    )
    return FreeRunFigures(
        wide=draw_free_run(joint, run),
        narrow=draw_free_run(joint, run, width=350, height=520),
    )
