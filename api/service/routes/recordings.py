"""Recordings: download, and signals for plots."""

import csv
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Query, Request
from fastapi.responses import FileResponse, StreamingResponse
from starlette.responses import Response

from api.service import access, text_forms
from api.service.access import service_of
from api.service.binary_signals import MEDIA_TYPE, signals_response
from api.service.envelope import visible_rows
from api.service.openapi import ResourceRoute, problems
from api.service.prediction_files import read_prediction
from api.service.problems import Problem
from api.service.routes.experiments import ExperimentId, SessionId
from api.service.routes.models import ModelId
from api.service.session_documents import RecordingFormat, RecordingSummary
from api.service.session_export import SessionFormat, SessionTable
from daq.raw_log import raw_log_of, text_of
from identify.recording import Session

router = APIRouter(tags=["recordings"], route_class=ResourceRoute)

From = Annotated[float | None, Query(alias="from", ge=-1e12, le=1e12, allow_inf_nan=False, description="s")]
To = Annotated[float | None, Query(alias="to", ge=-1e12, le=1e12, allow_inf_nan=False, description="s")]
Points = Annotated[int, Query(ge=2, le=20_000, description="rows at most")]
BINARY = {
    200: {"content": {MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}, "example": "(float32)"}}}
}
CSV_BLOCK = 2000
"""Rows of CSV written at a time."""


def _path(request: Request, experiment: str, session: str) -> Path:
    experiments = service_of(request).experiments
    row = experiments.session(experiment, session)
    if row.file is None:
        raise Problem(409, f"The session {session} is {row.state}; it has no recording yet.")
    path = experiments.folder(experiment) / row.file
    if not path.is_file():
        raise Problem(404, f"The file {row.file} of the session {session} is not there.")
    return path


def _samples(request: Request, experiment: str, session: str) -> Session:
    experiments = service_of(request).experiments
    _place, entry = experiments.session_place(experiment, session)
    return service_of(request).samples.read(experiments.folder(experiment), entry.file)


def _formats(path: Path, measured: bool) -> list[RecordingFormat]:
    """What a session's file can be had as; SI units want a session that the experiment lists."""
    formats = [RecordingFormat.ORIGINAL]
    if measured:
        formats += [
            RecordingFormat.CSV,
            RecordingFormat.MAT,
            RecordingFormat.PARQUET,
            RecordingFormat.HDF5_SI,
        ]
    elif path.name.lower().endswith((".csv", ".csv.gz")):
        formats.append(RecordingFormat.CSV)
    if path.suffix.lower() == ".h5":
        formats.append(RecordingFormat.HDF5)
    if raw_log_of(path).is_file():
        formats.append(RecordingFormat.RAW)
    return formats


@router.get("/experiments/{experiment}/recordings", responses=problems(409))
def list_recordings(
    request: Request, _user: access.Viewer, experiment: ExperimentId
) -> list[RecordingSummary]:
    """The recordings of an experiment, also those that ended badly."""
    experiments = service_of(request).experiments
    folder = experiments.folder(experiment)
    listed = {each.file for each in experiments.declared(experiment).sessions}
    views = []
    for row in experiments.sessions(experiment):
        if row.file is not None and (path := folder / row.file).is_file():
            views.append(
                RecordingSummary(
                    session=row.id,
                    file=row.file,
                    bytes=path.stat().st_size,
                    formats=_formats(path, row.file in listed),
                )
            )
    return views


@router.get(
    "/experiments/{experiment}/recordings/{session}",
    response_class=Response,
    responses=problems(409, 413)
    | {
        200: {
            "content": {
                "application/x-hdf5": {"schema": {"type": "string", "format": "binary"}, "example": "(HDF5)"},
                "text/csv": {"schema": {"type": "string"}, "example": "t,q1,v1\n0.0,0.35,1.2\n"},
                "text/plain": {"schema": {"type": "string"}, "example": "(0.000000) can0 080#\n"},
                "application/gzip": {"schema": {"type": "string", "format": "binary"}, "example": "(gzip)"},
            }
            | {
                form.media_type: {
                    "schema": {"type": "string", "format": "binary"},
                    "example": f"({form.value})",
                }
                for form in SessionFormat
                if form is not SessionFormat.HDF5_SI
            }
        }
    },
)
def download(
    request: Request,
    _user: access.Viewer,
    experiment: ExperimentId,
    session: SessionId,
    format: RecordingFormat = RecordingFormat.ORIGINAL,
) -> Response:
    """Download a recording: the original file, HDF5 in counts, the raw frame log; or all samples in SI units as CSV,
    MAT (version 5), Parquet or HDF5 (`hdf5-si`), in columns t, q1 …, v1 …, ext1 …, temp1 ….
    """
    path = _path(request, experiment, session)
    declared = service_of(request).experiments.declared(experiment)
    listed = str(path.relative_to(service_of(request).experiments.folder(experiment)))
    if format not in _formats(path, listed in {each.file for each in declared.sessions}):
        raise Problem(409, f"The recording {session} has no {format.value}: it is {path.name}.")
    if format is RecordingFormat.CSV and not path.name.lower().endswith((".csv", ".csv.gz")):
        samples = _samples(request, experiment, session)
        headers = {"Content-Disposition": f'attachment; filename="{path.stem}.csv"'}
        return StreamingResponse(_csv(samples), media_type="text/csv", headers=headers)
    if format.value in {each.value for each in SessionFormat}:
        form = SessionFormat(format.value)
        service_of(request).disk.require_room()
        table = SessionTable.of(declared, _samples(request, experiment, session))
        size, blocks = table.sent(form, service_of(request).settings.data_folder)
        headers = {
            "Content-Disposition": f'attachment; filename="{session}{form.ending}"',
            "Content-Length": str(size),
        }
        return StreamingResponse(blocks, media_type=form.media_type, headers=headers)
    if format is RecordingFormat.RAW:
        headers = {"Content-Disposition": f'attachment; filename="{path.stem}.log"'}
        return StreamingResponse(text_of(raw_log_of(path)), media_type="text/plain", headers=headers)
    kinds = {".h5": "application/x-hdf5", ".csv": "text/csv", ".gz": "application/gzip"}
    return FileResponse(path, media_type=kinds.get(path.suffix.lower(), MEDIA_TYPE), filename=path.name)


def _csv(samples: Session) -> Iterator[str]:
    """The contract's columns, block by block; numbers with all their digits."""
    n = samples.n
    header = ["t", *(f"q{j}" for j in range(1, n + 1)), *(f"v{j}" for j in range(1, n + 1))]
    columns = [samples.time[:, None], samples.position, samples.command]
    for name, values in (("ext", samples.external), ("temp", samples.temperature)):
        if values is not None:
            header += [f"{name}{j}" for j in range(1, n + 1)]
            columns.append(values)
    for start in range(0, len(samples.time), CSV_BLOCK):
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        if start == 0:
            writer.writerow(header)
        writer.writerows(np.hstack([each[start : start + CSV_BLOCK] for each in columns]).tolist())
        yield text.getvalue()


@router.get(
    "/experiments/{experiment}/recordings/{session}/signals",
    response_class=Response,
    responses=problems(409, 413) | BINARY,
)
def recorded_signals(
    request: Request,
    _user: access.Viewer,
    experiment: ExperimentId,
    session: SessionId,
    joint: Annotated[int, Query(ge=1, le=1000, description="counted from 1")] = 1,
    start: From = None,
    end: To = None,
    points: Points = 2000,
) -> Response:
    """Position and command of one joint, as the smallest and largest values of the visible range.

    The body is little-endian float32, column by column as X-Columns says: time less X-Time-Origin,
    position, command.
    """
    samples = _samples(request, experiment, session)
    if joint > samples.n:
        raise Problem(404, f"The robot has {samples.n} joints.")
    signals = {"position": samples.position[:, joint - 1], "command": samples.command[:, joint - 1]}
    return signals_response(samples.time, signals, start, end, points)


@router.get(
    "/experiments/{experiment}/models/{model}/signals",
    response_class=Response,
    responses=problems(409, 413) | BINARY,
)
def model_signals(
    request: Request,
    _user: access.Viewer,
    experiment: ExperimentId,
    model: ModelId,
    session: Annotated[str, Query(pattern=text_forms.SESSION_ID, examples=["session-00"])],
    joint: Annotated[int, Query(ge=1, le=1000, description="counted from 1")] = 1,
    start: From = None,
    end: To = None,
    points: Points = 2000,
) -> Response:
    """Torque measured, predicted, and the error of one joint, as the smallest and largest values of the
    visible range.

    The body is little-endian float32, column by column as X-Columns says: time less X-Time-Origin,
    measured, predicted, error, position, velocity, load.
    """
    service = service_of(request)
    story = service.models.story(experiment)
    folder = story.fit_folder(model)
    place, _entry = service.experiments.session_place(experiment, session)
    stored = read_prediction(folder, place, joint - 1)
    if stored is None:
        raise Problem(404, f"The fit of {model} holds no joint {joint} of {session}; fit the model anew.")
    # Only what is seen is read from the file.
    rows = visible_rows(stored.time, start, end)
    measured, predicted = stored.measured[rows], stored.predicted[rows]
    signals = {
        "measured": measured,
        "predicted": predicted,
        "error": measured - predicted,
        "position": stored.position[rows],
        "velocity": stored.velocity[rows],
        "load": stored.load[rows],
    }
    return signals_response(stored.time[rows], signals, None, None, points)
