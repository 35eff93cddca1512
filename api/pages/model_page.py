"""Model and measurement: where the model agrees with what was measured, and where it does not."""

from dataclasses import dataclass
from urllib.parse import urlencode

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse

from api.pages import error_tables, without_payload_table
from api.pages.choices import (
    ALL_SESSIONS,
    JointChoice,
    SessionChoice,
    VersionChoice,
    chosen_model,
    files_of_session,
)
from api.pages.error_figures import JointUnits
from api.pages.experiment_frame import experiment_context, no_model_page
from api.pages.free_run_view import free_run_context
from api.pages.layout import experiment_link, frame
from api.pages.model_figures import CountedErrors, counted_errors, figures_of
from api.pages.motion_table import motion_panel
from api.pages.proof_words import proof_panel
from api.pages.rendering import PREFIX, page
from api.pages.sample_columns import Column, stored_columns
from api.pages.scope_words import scope_of_fit, scope_of_session
from api.pages.stored_models import ShownModel, StoredExperiment
from api.service import access
from identify.results.identification import Parameter

router = APIRouter(prefix=PREFIX, include_in_schema=False)


@router.get("/experiments/{experiment}/model")
def model_page(
    request: Request,
    user: access.Viewer,
    experiment: str,
    joint: JointChoice = None,
    session: SessionChoice = ALL_SESSIONS,
    version: VersionChoice = None,
    beside: VersionChoice = None,
) -> HTMLResponse:
    """The page: figures of one joint and model, or of two models beside each other."""
    stored = StoredExperiment(access.service_of(request).experiments, experiment)
    context = frame(request, user, "model", experiment)
    joint = stored.joint_or_first(joint)
    shown = chosen_model(stored, version) or stored.current()
    if shown is None:
        return no_model_page(request, stored, joint, context)
    other = chosen_model(stored, beside)
    files = files_of_session(stored, shown, other, session)
    units = JointUnits.of(stored.declared.robot.joints[stored.joint_names.index(joint)].type)
    first = stored.model(stored.story.versions[0].id)
    models = [shown] if other is None else [shown, other]
    numbers = counted_errors(stored, models, joint, files)
    context |= experiment_context(stored, joint, shown, "model") | {
        "sessions": _session_choices(stored, shown, joint, session, version, beside),
        "session_choice": session,
        "versions": [stored.model(each.id) for each in stored.story.versions],
        "shown_version": shown.number,
        "beside_version": other.number if other else None,
        "compared_words": f"model {(other or first).number}",
        "headline": _headline(shown, joint, numbers, session),
        "scope": scope_of_fit(shown) if session == ALL_SESSIONS else scope_of_session(shown, session),
        "units": units,
        "figures": figures_of(stored, models, joint, files, units),
        "tables": numbers.tables | {"joints": _by_joint(stored, models)},
        "table_models": [f"model {model.number}" for model in models],
        "without_payload": without_payload_table.table_rows(models, joint),
        "without_payload_link": _without_payload_link(stored, models)
        if without_payload_table.can_be_asked(stored)
        else None,
        "parameter_tables": [_parameter_table(model, joint) for model in models],
        "others": [] if session == ALL_SESSIONS else _other_sessions(stored, shown, other, session),
        "plot_columns": _plot_columns(stored, joint),
    }
    query = urlencode(
        {"joint": joint, "session": session, "version": shown.version.id, "beside": beside or ""}
    )
    for name in ("samples", "chosen", "pairs", "columns"):
        context[f"{name}_link"] = f"{experiment_link(experiment, name)}?{query}"
    use = access.service_of(request).model_use
    context |= motion_panel(use, stored.id, shown.version.id, joint)
    context |= free_run_context(use, stored, shown, joint, session)
    context |= proof_panel(access.service_of(request), stored.id, str(shown.number))
    return page(request, "model.html", **context)


def _without_payload_link(stored: StoredExperiment, models: list[ShownModel]) -> str:
    query = urlencode([("version", model.version.id) for model in models])
    return f"{experiment_link(stored.id, 'without-payload')}?{query}"


@dataclass(frozen=True)
class SessionTab:
    """A session, or all of them, that the page can show."""

    words: str
    here: bool
    link: str


@dataclass(frozen=True)
class OtherSession:
    """A session that can be laid over the one that is shown."""

    file: str
    words: str


@dataclass(frozen=True)
class Headline:
    """The figures above the plots, N m or N, with what each is of."""

    samples: int
    rms: float | None
    rms_measured: float | None
    error: float | None
    error_note: str
    whole: bool
    validation: float | None
    validation_note: str
    floor: float | None
    floor_note: str
    condition: float | None


@dataclass(frozen=True)
class ParameterTable:
    """The parameters of one model on the joint."""

    version: int
    words: str
    usual: bool
    parameters: list[Parameter]


def _session_choices(
    stored: StoredExperiment,
    shown: ShownModel,
    joint: str,
    here: str,
    version: str | None,
    beside: str | None,
) -> list[SessionTab]:
    kept = {"joint": joint, "version": version or "", "beside": beside or ""}
    base = experiment_link(stored.id, "model")
    choices = [(ALL_SESSIONS, "All sessions")]
    choices += [
        (file, f"{index} · {stored.payload_of[file]}")
        for index, file in enumerate(stored.fitted_files(shown), 1)
    ]
    return [
        SessionTab(
            words=label,
            here=value == here,
            link=f"{base}?{urlencode(kept | {'session': value})}",
        )
        for value, label in choices
    ]


def _other_sessions(
    stored: StoredExperiment, shown: ShownModel, other: ShownModel | None, here: str
) -> list[OtherSession]:
    """Sessions that can be laid over the one that is shown: those that all shown models were fitted with."""
    known = files_of_session(stored, shown, other, ALL_SESSIONS)
    return [
        OtherSession(
            file=file,
            words=f"{index} · {stored.payload_of[file]}",
        )
        for index, file in enumerate(stored.fitted_files(shown), 1)
        if file != here and file in known
    ]


def _plot_columns(stored: StoredExperiment, here: str) -> list[tuple[str, list[Column]]]:
    """Columns that can be plotted over each other, by joint, the one that is shown first."""
    groups = []
    for joint in sorted(stored.joint_names, key=lambda name: name != here):
        kind = stored.declared.robot.joints[stored.joint_names.index(joint)].type
        columns = stored_columns(JointUnits.of(kind))
        if joint != here:
            columns = [
                Column(f"{each.name}@{joint}", f"{each.label} of {joint}", each.unit) for each in columns
            ]
        groups.append((joint, columns))
    return groups


def _headline(shown: ShownModel, joint: str, numbers: CountedErrors, session: str) -> Headline:
    """The figures above the plots: of the scope that the page names, or of the joint where they have no other."""
    part = shown.joint(joint)
    whole = session == ALL_SESSIONS
    validation, floor = part.relative_error_validation, part.noise_floor
    return Headline(
        samples=numbers.samples,
        rms=numbers.rms,
        rms_measured=numbers.rms_measured,
        error=(part.relative_error if whole else numbers.relative_error),
        error_note=f"model {shown.number}: {shown.words}",
        whole=whole,
        validation=validation,
        validation_note=("validation sessions" if validation is not None else "no validation session yet"),
        floor=floor,
        floor_note=(
            "of the joint; what no model can explain" if floor is not None else "needs motion that repeats"
        ),
        condition=shown.document.condition_number,
    )


def _by_joint(stored: StoredExperiment, models: list[ShownModel]) -> list[error_tables.ErrorRow]:
    return [
        error_tables.ErrorRow(
            name,
            models[0].samples_of(name),
            tuple(model.joint(name).relative_error for model in models),
        )
        for name in stored.joint_names
    ]


def _parameter_table(model: ShownModel, joint: str) -> ParameterTable:
    parameters = [entry for entry in model.document.parameters if entry.joint == joint]
    return ParameterTable(
        version=model.number,
        words=model.words,
        usual=(model.version.model == "usual" and not model.version.add),
        parameters=parameters,
    )
