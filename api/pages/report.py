"""The report: one HTML file that stands alone, with its figures inside, to print or to keep; sent while it is drawn."""

import hashlib
from base64 import b64encode
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from fastapi import APIRouter, Request
from fastapi.responses import Response
from markupsafe import Markup

from api.pages.catalogue_words import effect_titles, entry_of
from api.pages.choices import VersionChoice, chosen_model
from api.pages.motion_table import certificate_words
from api.pages.parameter_tables import constants_in_words, effects_in_model, parameter_groups
from api.pages.rendering import PREFIX, render_pieces
from api.pages.report_section import JointSection
from api.pages.scope_words import UNSEEN, USES, scope_of_fit
from api.pages.static_content import static_files
from api.pages.stored_models import ShownModel, StoredExperiment
from api.pages.streamed import streamed
from api.service import access
from api.service.problems import Problem
from api.service.session_catalogue import CatalogueEntry
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
    pieces, style = write_report(
        stored, shown, user.name, service.catalogue.entries(stored.id), list(certificates.values())
    )
    digest = b64encode(hashlib.sha256(style.encode()).digest()).decode()
    headers = {
        "Content-Security-Policy": f"default-src 'none'; style-src 'sha256-{digest}'; frame-ancestors 'none'",
        "Cache-Control": "no-store",
    }
    if keep:
        headers["Content-Disposition"] = f'attachment; filename="{stored.id}-model-{shown.number}.html"'
    return streamed(request, pieces, headers)


def write_report(
    stored: StoredExperiment,
    shown: ShownModel,
    author: str,
    entries: Sequence[CatalogueEntry],
    certificates: Sequence[Certificate],
) -> tuple[Iterator[str], str]:
    """The report's HTML piece by piece, and the style sheet that stands in it.

    entries      : the catalogue of the experiment's sessions
    certificates : of what the model was exported to
    """
    style = "\n".join(static_files()[name].content.decode() for name in STYLE_SHEETS)
    # The file stands alone: it has no typeface beside it, and takes the reader's own.
    style = style[: style.index("@font-face")] + style[style.rindex("@font-face") :].split("}", 1)[1]
    pieces = render_pieces(
        "report.html",
        style=Markup(style),
        experiment=stored,
        shown=shown,
        unseen_scope=UNSEEN,
        document=shown.document,
        author=author,
        written=datetime.now(UTC),
        scope=scope_of_fit(shown),
        sessions=_sessions(shown, entries),
        certificates=[(each.target, certificate_words(each)) for each in certificates],
        constants=constants_in_words(stored, shown),
        sections=[JointSection(stored, shown, joint) for joint in stored.joint_names],
        groups=parameter_groups(stored, shown),
        effects=[(each, entry_of(each.name)) for each in effects_in_model(stored, shown)],
        titles=effect_titles(),
    )
    return pieces, style


@dataclass(frozen=True)
class SessionRow:
    """A session: where, when and by whom it was measured, how it is used, and its error."""

    file: str | None
    payload: str
    rig: str | None
    started: str | None
    operator: str | None
    seconds: float | None
    use: str
    error: float | None
    note: str


def _sessions(shown: ShownModel, entries: Sequence[CatalogueEntry]) -> list[SessionRow]:
    """Every session of the fit, and every one that was excluded: where, when and by whom it was measured, and its error."""
    catalogue = {entry.row.file: entry for entry in entries}
    fitted = {each.file: each for each in shown.document.sessions}
    return [
        SessionRow(
            file=file,
            payload=entry.row.payload.name,
            rig=entry.rig,
            started=entry.facts.started,
            operator=entry.facts.operator,
            seconds=(entry.facts.seconds if entry.facts.seconds is not None else of_fit and of_fit.duration),
            use=(USES[of_fit.role] if of_fit else f"excluded: {entry.excluded}"),
            error=(of_fit and of_fit.relative_error),
            note=entry.note,
        )
        for file, entry in catalogue.items()
        if (of_fit := fitted.get(file or "")) is not None or entry.excluded is not None
    ]
