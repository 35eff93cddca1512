"""The report: one HTML file that stands alone, with its figures inside, to print or to keep."""

import hashlib
from base64 import b64encode
from datetime import UTC, datetime

import numpy as np
from fastapi import APIRouter, Request
from fastapi.responses import Response
from markupsafe import Markup

from api.pages.catalogue_words import effect_titles, entry_of
from api.pages.choices import VersionChoice, chosen_model
from api.pages.error_figures import JointUnits
from api.pages.evidence_view import joint_diagnosis
from api.pages.figures.torque_time import draw_torque_time
from api.pages.model_figures import counted_errors, figures_of
from api.pages.model_steps import step_chart
from api.pages.parameter_tables import effects_in_model, parameter_groups
from api.pages.rendering import PREFIX, STATIC_FOLDER, Context, render
from api.pages.stored_models import ShownModel, StoredExperiment
from api.pages.verdict_words import verdict_of
from api.service import access
from api.service.problems import Problem

router = APIRouter(prefix=PREFIX, include_in_schema=False)

STYLE_SHEETS = ("instrument.css", "figures.css", "report.css")


@router.get("/experiments/{experiment}/report")
def report(
    request: Request,
    user: access.Viewer,
    experiment: str,
    version: VersionChoice = None,
    keep: bool = False,
) -> Response:
    """The report of a model; with `keep` as a file to download."""
    stored = StoredExperiment(access.service_of(request).experiments, experiment)
    shown = chosen_model(stored, version) or stored.current()
    if shown is None:
        raise Problem(404, "There is no model yet.")
    text, style = write_report(stored, shown, user.name)
    digest = b64encode(hashlib.sha256(style.encode()).digest()).decode()
    headers = {
        "Content-Security-Policy": f"default-src 'none'; style-src 'sha256-{digest}'; frame-ancestors 'none'",
        "Cache-Control": "no-store",
    }
    if keep:
        headers["Content-Disposition"] = f'attachment; filename="{stored.id}-model-{shown.number}.html"'
    return Response(text, media_type="text/html", headers=headers)


def write_report(stored: StoredExperiment, shown: ShownModel, author: str) -> tuple[str, str]:
    """The report's HTML, and the style sheet that stands in it."""
    style = "\n".join((STATIC_FOLDER / name).read_text() for name in STYLE_SHEETS)
    # The file stands alone: it has no typeface beside it, and takes the reader's own.
    style = style[: style.index("@font-face")] + style[style.rindex("@font-face") :].split("}", 1)[1]
    text = render(
        "report.html",
        style=Markup(style),
        experiment=stored,
        shown=shown,
        document=shown.document,
        author=author,
        written=datetime.now(UTC),
        sections=[_joint_section(stored, shown, joint) for joint in stored.joint_names],
        groups=parameter_groups(stored, shown),
        effects=[(each, entry_of(each.name)) for each in effects_in_model(stored, shown)],
        titles=effect_titles(),
    )
    return text, style


def _joint_section(stored: StoredExperiment, shown: ShownModel, joint: str) -> Context:
    """Verdict, staircase, torque of every session, map, bands and tables of one joint."""
    units = JointUnits.of(stored.declared.robot.joints[stored.joint_names.index(joint)].type)
    files = stored.fitted_files(shown)
    first = stored.model(stored.story.versions[0].id)
    models, labels = [shown], ["this model"]
    if first.version.id != shown.version.id and stored.fitted_files(first) == files:
        models, labels = [shown, first], ["this model", "first model"]
    floor = shown.joint(joint).noise_floor
    sessions = []
    for file, columns in stored.stored_samples(shown, joint, files).items():
        time, measured, predicted = (np.asarray(columns[each]) for each in ("time", "measured", "predicted"))
        drawing = draw_torque_time(
            time, measured, predicted, "torque" if units.load == "N m" else "force", units.load
        )
        sessions.append({"file": file, "payload": stored.payload_of[file], "figure": drawing})
    return {
        "name": joint,
        "part": shown.joint(joint),
        "verdict": verdict_of(joint_diagnosis(stored, shown, joint), floor, effect_titles()),
        "staircase": step_chart(stored, joint, floor),
        "sessions": sessions,
        "figures": figures_of(stored, [shown], first, joint, files, units),
        "tables": counted_errors(stored, models, joint, files).tables,
        "models": labels,
        "units": units,
    }
