"""The sessions of an experiment: what became of each, its files, recovery of one that was cut off, and adding one from a
file; and the upload of a whole experiment.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path
from typing import Annotated, Literal
from urllib.parse import urlencode

from fastapi import APIRouter, File, Form, Query, Request, UploadFile
from fastapi.responses import HTMLResponse, Response

from api.pages.experiment_frame import experiment_context
from api.pages.form_input import input_errors_as_problems, typed_mass
from api.pages.layout import experiment_link, frame
from api.pages.rendering import PREFIX, Context, page
from api.pages.scope_words import USES
from api.pages.stored_models import StoredExperiment
from api.service import access
from api.service.accounts import User
from api.service.problems import Problem
from api.service.service import Service
from api.service.session_catalogue import CatalogueEntry
from api.service.unlisted_recordings import ENDED_EARLY, RECORDING
from daq.raw_log import raw_log_of
from daq.session_events import SessionState
from identify.recording import Payload
from identify.recording.plain_text import check_printable
from identify.results.identification import SessionError

router = APIRouter(prefix=PREFIX, include_in_schema=False)

NEW = "new"
"""Value of the choice `another payload`."""
MEBIBYTE = 1024 * 1024

ON_THEIR_WAY = frozenset(state.value for state in SessionState if not state.ended)
"""States of a session that is being prepared or measured."""
STATE_WORDS = {
    "measured": ("good", "measured"),
    "complete": ("good", "measured"),
    "done": ("good", "measured"),
    "aborted": ("warn", "stopped; kept, not used"),
    "faulted": ("fault", "ended by a fault; kept, not used"),
    "damaged": ("fault", "the file cannot be read"),
    "missing": ("fault", "the file is not there"),
    RECORDING: ("warn", "cut off while it was recorded"),
}
"""State of a session -> its colour, and what an operator calls it; others are on their way to be measured."""
PASSED_OVER = "passed-over"
"""Of the cookie: id of the experiment that was uploaded last, and what of its archive was not taken."""
LONGEST_WORDS = 600
"""Letters of it; a cookie holds 4096 bytes."""
SORTED = ("id", "started", "rig", "payload", "plan", "use", "state", "seconds", "lost", "error")
"""Columns that the catalogue can be sorted by."""
FILTERED = ("rig", "operator", "payload", "plan", "use", "state")
"""Columns that the catalogue can be filtered by."""
Word = Annotated[str, Query(max_length=255)]


@dataclass(frozen=True)
class Download:
    """A form in which a recording can be had."""

    name: str
    link: str


@dataclass(frozen=True)
class SessionLine:
    """One session in the catalogue, as the page shows it: masses in kg, times in s, sizes in MiB."""

    id: str
    payload: str
    mass: float | None
    weighed: float | None
    rig: str
    operator: str
    plan: str
    started: str | None
    seconds: float | None
    lost: float | None
    note: str
    excluded: str | None
    use: str
    role: str
    tone: str
    state: str
    reason: str
    error: float | None
    megabytes: float | None
    downloads: list[Download]
    recoverable: bool
    recover_link: str
    admissible: bool
    admit_link: str
    continue_link: str | None
    changeable: bool
    noted: bool
    link: str

    @property
    def texts(self) -> tuple[str, ...]:
        """What is searched for words."""
        return (self.id, self.note, self.reason, self.payload, self.excluded or "", self.plan, self.operator)

    def column(self, name: str) -> str | float | None:
        """What stands in the column of that name, one of `SORTED` or `FILTERED`."""
        return getattr(self, name)


@dataclass(frozen=True)
class CatalogueChoice:
    """How the catalogue is to be shown: by which column, in which order, which sessions.

    only : column -> the value that it must have
    text : what must stand in a session's id, note, reason or payload
    """

    sort: str = "id"
    descending: bool = False
    only: Mapping[str, str] = field(default_factory=dict)
    text: str = ""

    def applied(self, entries: list[SessionLine]) -> list[SessionLine]:
        """The sessions that are chosen, in order; those that have no value there come last."""
        chosen = [
            row for row in entries if all(row.column(name) == value for name, value in self.only.items())
        ]
        if self.text:
            wanted = self.text.casefold()
            chosen = [row for row in chosen if any(wanted in text.casefold() for text in row.texts)]
        empty = [row for row in chosen if row.column(self.sort) in (None, "")]
        given = [row for row in chosen if row.column(self.sort) not in (None, "")]
        return sorted(given, key=attrgetter(self.sort), reverse=self.descending) + empty

    def query(self, sort: str) -> dict[str, str]:
        """The address's query for another column; the same column turns the order round."""
        turned = sort == self.sort and not self.descending
        shown = {"sort": sort, "order": "down" if turned else "up", "text": self.text, **self.only}
        return {name: value for name, value in shown.items() if value}


@router.get("/experiments/{experiment}/sessions")
def sessions_page(
    request: Request,
    user: access.Viewer,
    experiment: str,
    sort: Word = "id",
    order: Word = "up",
    text: Word = "",
    rig: Word = "",
    operator: Word = "",
    payload: Word = "",
    plan: Word = "",
    use: Word = "",
    state: Word = "",
) -> HTMLResponse:
    """The catalogue of sessions, as it was asked for."""
    given = dict(zip(FILTERED, (rig, operator, payload, plan, use, state), strict=True))
    wanted = CatalogueChoice(
        sort if sort in SORTED else "id",
        order == "down",
        {name: value for name, value in given.items() if value},
        text,
    )
    return page(request, "sessions.html", **_context(request, user, experiment, wanted))


@router.post("/experiments/{experiment}/sessions/{session}/change")
def change(
    request: Request,
    user: access.Operator,
    experiment: str,
    session: str,
    use: Annotated[Literal["fit", "validation", "excluded"], Form()],
    reason: Annotated[str, Form(max_length=500)] = "",
    note: Annotated[str, Form(max_length=2000)] = "",
) -> HTMLResponse:
    """Fit models to a session, only check them on it, or exclude it with a reason; and keep a note beside it."""
    catalogue = access.service_of(request).catalogue
    with input_errors_as_problems():
        entry = catalogue.entry(experiment, session)
        changed_note = note if note.strip() != entry.note else None
        if use == "excluded":
            catalogue.change(experiment, session, user.name, excluded=reason, note=changed_note)
        else:
            role = "identification" if use == "fit" else "validation"
            catalogue.change(
                experiment,
                session,
                user.name,
                role=role if entry.measured else None,
                excluded=False,
                note=changed_note,
            )
    return page(request, "sessions_body.html", **_context(request, user, experiment))


@router.post("/experiments/{experiment}/sessions/{session}/recover")
def recover(request: Request, user: access.Operator, experiment: str, session: str) -> HTMLResponse:
    """Close a recording that was cut off; what was measured until then is kept."""
    with input_errors_as_problems():
        access.service_of(request).unlisted_recordings.recover(experiment, session, user)
    return page(request, "sessions_body.html", **_context(request, user, experiment))


@router.post("/experiments/{experiment}/sessions/{session}/admit")
def admit(request: Request, user: access.Operator, experiment: str, session: str) -> HTMLResponse:
    """Use a session that ended early: whoever presses this has looked at it."""
    with input_errors_as_problems():
        access.service_of(request).unlisted_recordings.admit(experiment, session, user)
    return page(request, "sessions_body.html", **_context(request, user, experiment))


@router.post("/experiments/{experiment}/sessions/import")
def add_session(
    request: Request,
    user: access.Operator,
    experiment: str,
    file: Annotated[UploadFile, File()],
    payload: Annotated[str, Form(max_length=100)],
    role: Annotated[Literal["identification", "validation"], Form()] = "identification",
    payload_name: Annotated[str, Form(max_length=64)] = "",
    mass: Annotated[str, Form(max_length=20)] = "",
) -> Response:
    """Add a session that was measured elsewhere; all sessions are identified anew."""
    service = access.service_of(request)
    new = None
    if payload == NEW:
        payload = payload_name.strip()
        if not payload:
            raise Problem(422, "Give the new payload a name.")
        try:
            new = Payload(name=check_printable(payload), mass=typed_mass(mass))
        except ValueError as error:
            raise Problem(422, f"The name of the payload {error}.") from error
    with input_errors_as_problems():
        service.jobs.refuse_more(user.name)
        service.disk.require_room()
        service.uploads.add_session(experiment, file.file, file.filename or "", payload, role, new)
    service.models.refit(experiment, user.name)
    return Response(status_code=204, headers={"HX-Redirect": experiment_link(experiment, "sessions")})


@router.post("/experiments/import")
def add_experiment(request: Request, user: access.Operator, file: Annotated[UploadFile, File()]) -> Response:
    """Store an experiment that was measured elsewhere; it is identified at once."""
    service = access.service_of(request)
    with input_errors_as_problems():
        service.jobs.refuse_more(user.name)
        service.disk.require_room()
        added = service.uploads.add_experiment(file.file)
    service.models.refit(added.row.id, user.name)
    names = ", ".join(added.passed_over)
    shortened = names if len(names) <= LONGEST_WORDS else f"{names[:LONGEST_WORDS]} …"
    request.session[PASSED_OVER] = [added.row.id, shortened]  # for the page that follows
    return Response(status_code=204, headers={"HX-Redirect": experiment_link(added.row.id, "sessions")})


@router.post("/experiments/{experiment}/sessions/passed-over/dismiss")
def dismiss_passed_over(request: Request, _user: access.Operator, experiment: str) -> HTMLResponse:
    """Say no more what of the uploaded archive was not taken."""
    request.session.pop(PASSED_OVER, None)
    return HTMLResponse("")


def _passed_over(request: Request, experiment: str) -> str:
    """What of the archive that this experiment came from was not taken; empty once that was put away."""
    uploaded, names = request.session.get(PASSED_OVER, ("", ""))
    return names if uploaded == experiment else ""


def _context(request: Request, user: User, experiment: str, wanted: CatalogueChoice | None = None) -> Context:
    service = access.service_of(request)
    stored = StoredExperiment(service.experiments, experiment)
    shown = stored.current()
    fitted = {each.file: each for each in shown.document.sessions} if shown else {}
    entries = [
        _session(service, experiment, entry, fitted) for entry in service.catalogue.entries(experiment)
    ]
    wanted = wanted or CatalogueChoice()
    context = frame(request, user, "sessions", experiment)
    context |= experiment_context(stored, stored.joint_names[0], shown, "sessions")
    return context | {
        "passed_over": _passed_over(request, experiment),
        "rows": wanted.applied(entries),
        "choice": wanted,
        "choices": {name: _values(entries, name) for name in FILTERED},
        "sort_links": {
            name: f"{experiment_link(experiment, 'sessions')}?{urlencode(wanted.query(sort=name))}"
            for name in SORTED
        },
        "all_rows": entries,
        "rigs": list(dict.fromkeys(row.rig for row in entries if row.rig)),
        "cut_off": [row for row in entries if row.recoverable],
        "payloads": stored.declared.payloads,
        "upload_limit": service.settings.upload_limit,
        "here_link": experiment_link(experiment, "sessions"),
        "add_link": experiment_link(experiment, "sessions/import"),
    }


def _session(
    service: Service, experiment: str, entry: CatalogueEntry, fitted: Mapping[str, SessionError]
) -> SessionLine:
    row, facts = entry.row, entry.facts
    tone, label = STATE_WORDS.get(row.state, ("idle", row.state))
    if row.state in ENDED_EARLY and not row.file:
        label = label.replace("kept, not used", "nothing was measured")
    elif row.state in ENDED_EARLY and entry.measured:
        label = label.replace("kept, not used", "used as far as recorded")
    link = experiment_link(experiment, f"sessions/{row.id}")
    active = service.sessions.active(row.rig or "")
    under_way = (
        active is not None
        and (active.experiment, active.id) == (experiment, row.id)
        and not active.state.ended
    )
    file = service.experiments.folder(experiment) / row.file if row.file else None
    there = file is not None and file.is_file()
    of_fit = fitted.get(row.file or "")
    return SessionLine(
        id=row.id,
        payload=row.payload.name,
        mass=row.payload.mass,
        weighed=row.weighed,
        rig=(entry.rig or ""),
        operator=(facts.operator or ""),
        plan=(entry.plan or ""),
        started=facts.started,
        seconds=(facts.seconds if facts.seconds is not None else of_fit.duration if of_fit else None),
        lost=facts.lost,
        note=entry.note,
        excluded=entry.excluded,
        use=("excluded" if entry.excluded is not None else USES[row.role] if entry.measured else "not used"),
        role=row.role,
        tone=tone,
        state=("the robot moves" if under_way and row.state == RECORDING else label),
        reason=(row.reason or ""),
        error=(of_fit.relative_error if of_fit else None),
        megabytes=(file.stat().st_size / MEBIBYTE if there and file is not None else None),
        downloads=[
            Download(
                name=name,
                link=f"/experiments/{experiment}/recordings/{row.id}?format={kind}",
            )
            for kind, name in (_formats(file, entry.measured) if there and file is not None else ())
        ],
        recoverable=(row.state == RECORDING and not under_way),
        recover_link=f"{link}/recover",
        admissible=(row.state in ENDED_EARLY and there and not entry.measured),
        admit_link=f"{link}/admit",
        continue_link=(link if row.file is None and row.state in ON_THEIR_WAY else None),
        changeable=entry.measured,
        noted=row.file is not None,
        link=link,
    )


def _formats(file: Path, measured: bool) -> list[tuple[str, str]]:
    """Forms in which a recording can be had: REST's word and a person's. SI units want a session that is listed."""
    recorded = file.suffix.lower() == ".h5"
    formats = [("original", "HDF5 in counts" if recorded else file.name.split(".", 1)[1].upper())]
    if measured:
        formats += [("csv", "CSV")] if recorded else []
        formats += [("mat", "MAT"), ("parquet", "Parquet"), ("hdf5-si", "HDF5 in SI units")]
    formats += [("raw", "raw frames")] if raw_log_of(file).is_file() else []
    return formats


def _values(entries: list[SessionLine], name: str) -> list[str]:
    """What the sessions have under a name, each once, in their order."""
    return list(dict.fromkeys(str(row.column(name)) for row in entries if row.column(name)))
