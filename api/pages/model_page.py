"""Model and measurement: where the model agrees with what was measured, and where it does not."""

from typing import Annotated, Any
from urllib.parse import urlencode

import numpy as np
from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse

from api.pages import error_tables, without_payload
from api.pages.error_figures import ErrorFigures, JointUnits, error_figures, tables
from api.pages.job_views import news_context, standing_fit
from api.pages.layout import experiment_link, frame
from api.pages.lru_cache import LruCache
from api.pages.rendering import PREFIX, page
from api.pages.stored_models import ShownModel, StoredExperiment
from api.service import access
from api.service.problems import Problem

router = APIRouter(prefix=PREFIX, include_in_schema=False)

ALL_SESSIONS = "all"
FIGURE_SAMPLES = 150_000
"""More samples than this are thinned for bands and maps; figures and tables of errors use all."""

_drawn: LruCache[ErrorFigures] = LruCache(64)
_counted: LruCache[dict[str, Any]] = LruCache(64)

JointChoice = Annotated[str | None, Query(max_length=64)]
SessionChoice = Annotated[str, Query(max_length=255)]
VersionChoice = Annotated[str | None, Query(max_length=12)]


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
        "headline": _headline(shown, joint, numbers),
        "units": units,
        "figures": figures_of(stored, models, first, joint, files, units),
        "tables": numbers["tables"] | {"joints": _by_joint(stored, models)},
        "table_models": [f"model {model.number}" for model in models],
        "without_payload": without_payload.table_rows(models, joint),
        "without_payload_link": _without_payload_link(stored, models)
        if without_payload.can_be_asked(stored)
        else None,
        "parameter_tables": [_parameter_table(model, joint) for model in models],
        "samples_link": f"{experiment_link(experiment, 'samples')}?"
        + urlencode(
            {"joint": joint, "session": session, "version": shown.version.id, "beside": beside or ""}
        ),
    }
    return page(request, "model.html", **context)


def no_model_page(
    request: Request, stored: StoredExperiment, joint: str, context: dict[str, Any]
) -> HTMLResponse:
    """What stands in place of a page that needs a model: how to come to one."""
    jobs = access.service_of(request).jobs
    context = context | experiment_context(stored, joint, None, "model")
    waiting = bool(stored.identification_files)
    return page(
        request,
        "no_model.html",
        **context,
        waiting=waiting,
        fit_link=experiment_link(stored.id, "steps/fit"),
        # What failed is not begun again by itself.
        begin=waiting and not jobs.jobs(experiment=stored.id, limit=1),
    )


def experiment_context(
    stored: StoredExperiment, joint: str, shown: ShownModel | None, here: str
) -> dict[str, Any]:
    """What the pages of an experiment have in common: its name and the tabs of its joints."""
    errors = {entry["joint"]: entry["relative_error"] for entry in shown.document["joints"]} if shown else {}
    joints = [
        {
            "name": name,
            "relative_error": errors.get(name),
            "link": f"{experiment_link(stored.id, here)}?{urlencode({'joint': name})}",
        }
        for name in stored.joint_names
    ]
    seen = standing_fit(stored.story)
    return {
        "experiment": stored,
        "joints": joints,
        "joint": joint,
        "own_news": False,
        "sessions_link": experiment_link(stored.id, "sessions"),
        **news_context(stored.id, seen, None),
    }


def _without_payload_link(stored: StoredExperiment, models: list[ShownModel]) -> str:
    query = urlencode([("version", model.version.id) for model in models])
    return f"{experiment_link(stored.id, 'without-payload')}?{query}"


def chosen_model(stored: StoredExperiment, number: str | None) -> ShownModel | None:
    """A version by its id (`m2`) or by its place (`2`); None for none. Raises the problem 404."""
    if not number:
        return None
    if number.isdigit():
        if not 1 <= int(number) <= len(stored.story.versions):
            raise Problem(404, f"The experiment has no model {number}.")
        return stored.model(stored.story.versions[int(number) - 1].id)
    return stored.model(number)


def files_of_session(
    stored: StoredExperiment, shown: ShownModel, other: ShownModel | None, session: str
) -> list[str]:
    files = stored.fitted_files(shown)
    if other is not None:
        files = [file for file in files if file in stored.fitted_files(other)]
    if session == ALL_SESSIONS:
        return files
    if session not in files:
        raise Problem(404, f"The model was not fitted with a session {session}; choose another or fit again.")
    return [session]


def _session_choices(
    stored: StoredExperiment,
    shown: ShownModel,
    joint: str,
    here: str,
    version: str | None,
    beside: str | None,
) -> list[dict[str, Any]]:
    kept = {"joint": joint, "version": version or "", "beside": beside or ""}
    base = experiment_link(stored.id, "model")
    choices = [(ALL_SESSIONS, "All sessions")]
    choices += [
        (file, f"{index} · {stored.payload_of[file]}")
        for index, file in enumerate(stored.fitted_files(shown), 1)
    ]
    return [
        {"words": words, "here": value == here, "link": f"{base}?{urlencode(kept | {'session': value})}"}
        for value, words in choices
    ]


def counted_errors(
    stored: StoredExperiment, models: list[ShownModel], joint: str, files: list[str]
) -> dict[str, Any]:
    """The tables of errors and the sizes of torque and error, of every sample in the fit; kept while they are seen."""

    def count() -> dict[str, Any]:
        samples = [stored.samples(model, joint, files).in_fit for model in models]
        of_shown = samples[0]
        return {
            "samples": len(of_shown.time),
            "rms": float(np.sqrt(np.mean(of_shown.error**2))) if len(of_shown.time) else None,
            "rms_measured": float(np.sqrt(np.mean(of_shown.measured**2))) if len(of_shown.time) else None,
            "tables": tables(samples, stored.payload_of, stored.identification_files),
        }

    return _counted.get((*(model.folder for model in models), joint, tuple(files)), count)


def _headline(shown: ShownModel, joint: str, numbers: dict[str, Any]) -> dict[str, Any]:
    part = shown.joint(joint)
    validation, floor = part["relative_error_validation"], part["noise_floor"]
    return numbers | {
        "error": part["relative_error"],
        "error_note": f"model {shown.number}: {shown.words}",
        "validation": validation,
        "validation_note": "validation sessions" if validation is not None else "no validation session yet",
        "floor": floor,
        "floor_note": "what no model can explain" if floor is not None else "needs motion that repeats",
        "condition": shown.document["condition_number"],
    }


def _by_joint(stored: StoredExperiment, models: list[ShownModel]) -> list[error_tables.ErrorRow]:
    return [
        error_tables.ErrorRow(
            name,
            models[0].document["samples"],
            tuple(model.joint(name)["relative_error"] for model in models),
        )
        for name in stored.joint_names
    ]


def _parameter_table(model: ShownModel, joint: str) -> dict[str, Any]:
    parameters = [entry for entry in model.document["parameters"] if entry["joint"] in (joint, None)]
    return {
        "version": model.number,
        "words": model.words,
        "usual": model.version.model == "usual" and not model.version.add,
        "parameters": parameters,
    }


def figures_of(
    stored: StoredExperiment,
    models: list[ShownModel],
    first: ShownModel,
    joint: str,
    files: list[str],
    units: JointUnits,
) -> ErrorFigures:
    """Draw the error of one or two models over `files`, on the scales of the first model."""

    def draw() -> ErrorFigures:
        shown, *others = (
            stored.samples(model, joint, files).thinned(FIGURE_SAMPLES).in_fit for model in models
        )
        known = stored.fitted_files(first)
        first_files = [file for file in files if file in known] or files
        start = stored.samples(first, joint, first_files).thinned(FIGURE_SAMPLES).in_fit
        return error_figures(shown, start, stored.payload_of, units, others[0] if others else None)

    return _drawn.get((*(model.folder for model in models), first.folder, joint, tuple(files)), draw)
