"""Results: the identified parameters, the files to take along, and the report."""

import csv
import io

import yaml
from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse, Response

from api.pages.choices import VersionChoice, chosen_model
from api.pages.experiment_frame import experiment_context, no_model_page
from api.pages.layout import experiment_link, frame
from api.pages.motion_table import export_remarks, export_rows
from api.pages.parameter_tables import constants_in_words, effects_in_model, parameter_groups
from api.pages.proof_words import proof_panel
from api.pages.rendering import PREFIX, page
from api.pages.stored_models import ShownModel, StoredExperiment
from api.service import access
from api.service.identified_urdf import can_be_made, urdf_of
from api.service.problems import Problem
from identify.recording.plain_text import text_cell
from identify.results.identification import Parameter

URDF_NAME = "URDF without certificate"
"""with viscous and dry friction as identified; the export to a URDF fits them to what the format can say, and certifies it"""

router = APIRouter(prefix=PREFIX, include_in_schema=False)


@router.get("/experiments/{experiment}/results")
def results_page(
    request: Request, user: access.Viewer, experiment: str, version: VersionChoice = None
) -> HTMLResponse:
    """The page."""
    stored = StoredExperiment(access.service_of(request).experiments, experiment)
    context = frame(request, user, "results", experiment)
    shown = chosen_model(stored, version) or stored.current()
    context |= experiment_context(stored, stored.joint_names[0], shown, "results")
    if shown is None:
        return no_model_page(request, stored, stored.joint_names[0], context)
    link = experiment_link(experiment, "download")
    formats = [("json", "JSON"), ("csv", "CSV"), ("yaml", "YAML")]
    if urdf_of(shown.folder) is not None:
        formats.append(("urdf", URDF_NAME))
    context |= {
        "shown": shown,
        "versions": [stored.model(each.id) for each in stored.story.versions],
        "document": shown.document,
        "groups": parameter_groups(stored, shown),
        "effects": effects_in_model(stored, shown),
        "constants": constants_in_words(stored, shown),
        "downloads": [
            {"name": name, "link": f"{link}/{ending}?version={shown.version.id}"} for ending, name in formats
        ],
        "urdf_name": URDF_NAME,
        "urdf_link": f"{experiment_link(experiment, 'urdf')}?version={shown.version.id}"
        if urdf_of(shown.folder) is None and can_be_made()
        else None,
        "exports": export_rows(access.service_of(request).model_use, stored.id, shown.version.id),
        "export_remarks": export_remarks(access.service_of(request).model_use, stored.id, shown.version.id),
        "report_link": f"{experiment_link(experiment, 'report')}?version={shown.version.id}",
        "results_link": f"/experiments/{experiment}/results",
    }
    context |= proof_panel(access.service_of(request), experiment, str(shown.number))
    return page(request, "results.html", **context)


@router.get("/experiments/{experiment}/download/{ending}")
def download(
    request: Request, _user: access.Viewer, experiment: str, ending: str, version: VersionChoice = None
) -> Response:
    """The results as a file."""
    stored = StoredExperiment(access.service_of(request).experiments, experiment)
    shown = chosen_model(stored, version) or stored.current()
    if shown is None:
        raise Problem(404, "There is no model yet: measure or import a session first.")
    if ending == "urdf":
        content, kind = urdf_of(shown.folder), "application/xml"
        if content is None:
            raise Problem(404, "There is no URDF of this model yet; make one on the results page.")
    elif ending in WRITERS:
        write, kind = WRITERS[ending]
        content = write(shown)
    else:
        raise Problem(404, f"There is no download as {ending}; there are json, csv and yaml.")
    name = f"{stored.id}-model-{shown.number}.{ending}"
    return Response(
        content, media_type=kind, headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )


def _as_json(shown: ShownModel) -> str:
    return shown.document.json_text(indent=1)


def _as_csv(shown: ShownModel) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Parameter.model_fields)
    for parameter in shown.document.parameters:
        values = parameter.to_json()
        writer.writerow([_cell(values[column]) for column in Parameter.model_fields])
    return text.getvalue()


def _cell(value: object) -> object:
    if isinstance(value, str):
        return text_cell(value)
    return "" if value is None else value


def _as_yaml(shown: ShownModel) -> str:
    return yaml.safe_dump(shown.document.to_json(), sort_keys=False, allow_unicode=True)


WRITERS = {
    "json": (_as_json, "application/json"),
    "csv": (_as_csv, "text/csv"),
    "yaml": (_as_yaml, "application/yaml"),
}
