"""The report: one HTML file that stands alone, with its figures inside, to print or to keep."""

import hashlib
from base64 import b64encode
from collections.abc import Sequence
from datetime import UTC, datetime

from fastapi import APIRouter, Request
from fastapi.responses import Response
from markupsafe import Markup

from api.pages.catalogue_words import effect_titles, entry_of
from api.pages.choices import VersionChoice, chosen_model
from api.pages.error_figures import JointUnits
from api.pages.evidence_view import added_evidence, joint_diagnosis
from api.pages.figures.torque_time import POINTS, TorqueRows, draw_torque_rows
from api.pages.model_figures import counted_errors, figures_of
from api.pages.model_steps import step_chart
from api.pages.motion_table import certificate_words
from api.pages.parameter_tables import constants_in_words, effects_in_model, parameter_groups
from api.pages.rendering import PREFIX, STATIC_FOLDER, Context, render
from api.pages.scope_words import USES, scope_of_fit
from api.pages.stored_models import ShownModel, StoredExperiment
from api.pages.torque_curves import TorqueCurves
from api.pages.verdict_words import unseen_error, verdict_of
from api.service import access
from api.service.problems import Problem
from api.service.session_catalogue import CatalogueEntry
from api.service.torque_outline import reduced
from identify.results.certificate import Certificate

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
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    shown = chosen_model(stored, version) or stored.current()
    if shown is None:
        raise Problem(404, "There is no model yet: measure or import a session first.")
    certificates = service.model_use.certificates(stored.id, shown.version.id)
    text, style = write_report(
        stored, shown, user.name, service.catalogue.entries(stored.id), list(certificates.values())
    )
    digest = b64encode(hashlib.sha256(style.encode()).digest()).decode()
    headers = {
        "Content-Security-Policy": f"default-src 'none'; style-src 'sha256-{digest}'; frame-ancestors 'none'",
        "Cache-Control": "no-store",
    }
    if keep:
        headers["Content-Disposition"] = f'attachment; filename="{stored.id}-model-{shown.number}.html"'
    return Response(text, media_type="text/html", headers=headers)


def write_report(
    stored: StoredExperiment,
    shown: ShownModel,
    author: str,
    entries: Sequence[CatalogueEntry],
    certificates: Sequence[Certificate],
) -> tuple[str, str]:
    """The report's HTML, and the style sheet that stands in it.

    entries      : the catalogue of the experiment's sessions
    certificates : of what the model was exported to
    """
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
        scope=scope_of_fit(shown),
        sessions=_sessions(shown, entries),
        certificates=[(each.target, certificate_words(each)) for each in certificates],
        constants=constants_in_words(stored, shown),
        sections=[_joint_section(stored, shown, joint) for joint in stored.joint_names],
        groups=parameter_groups(stored, shown),
        effects=[(each, entry_of(each.name)) for each in effects_in_model(stored, shown)],
        titles=effect_titles(),
    )
    return text, style


def _sessions(shown: ShownModel, entries: Sequence[CatalogueEntry]) -> list[Context]:
    """Every session of the fit, and every one that was excluded: where, when and by whom it was measured, and its error."""
    catalogue = {entry.row.file: entry for entry in entries}
    fitted = {each.file: each for each in shown.document.sessions}
    return [
        {
            "file": file,
            "payload": entry.row.payload["name"],
            "rig": entry.rig,
            "started": entry.facts.started,
            "operator": entry.facts.operator,
            "seconds": entry.facts.seconds if entry.facts.seconds is not None else of_fit and of_fit.duration,
            "use": USES[of_fit.role] if of_fit else f"excluded: {entry.excluded}",
            "error": of_fit and of_fit.relative_error,
            "note": entry.note,
        }
        for file, entry in catalogue.items()
        if (of_fit := fitted.get(file or "")) is not None or entry.excluded is not None
    ]


def _joint_section(stored: StoredExperiment, shown: ShownModel, joint: str) -> Context:
    """Verdict, staircase, torque of every session, map, bands and tables of one joint."""
    units = JointUnits.of(stored.declared.robot.joints[stored.joint_names.index(joint)].type)
    files = stored.fitted_files(shown)
    first = stored.model(stored.story.versions[0].id)
    models, labels = [shown], ["this model"]
    if first.version.id != shown.version.id and stored.fitted_files(first) == files:
        models, labels = [shown, first], ["this model", "first model"]
    floor = shown.joint(joint).noise_floor
    diagnosis = joint_diagnosis(stored, shown, joint)
    label = "torque" if units.load == "N m" else "force"
    sessions = [
        {
            "file": file,
            "payload": stored.payload_of[file],
            "figure": draw_torque_rows(rows, label, units.load),
        }
        for file, rows in _torque_of_sessions(stored, shown, joint, files).items()
    ]
    return {
        "name": joint,
        "part": shown.joint(joint),
        "unseen": unseen_error(diagnosis),
        "verdict": verdict_of(diagnosis, floor, effect_titles()),
        "added": added_evidence(stored, shown, joint),
        "staircase": step_chart(stored, joint, floor),
        "sessions": sessions,
        "figures": figures_of(stored, models, joint, files, units),
        "tables": counted_errors(stored, models, joint, files).tables,
        "models": labels,
        "units": units,
    }


def _torque_of_sessions(
    stored: StoredExperiment, shown: ShownModel, joint: str, files: list[str]
) -> dict[str, TorqueRows]:
    """By file, what is drawn of each whole session; the error only where the joint moves."""
    curves = TorqueCurves.of(stored, shown, joint, files)
    rows = {}
    for file, part in curves.parts.items():
        drawn, _ = reduced(part, curves.outlines[file], slice(0, len(part["time"])), POINTS)
        rows[file] = TorqueRows(drawn.time, **drawn.curves)
    return rows
