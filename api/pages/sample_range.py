"""The samples behind the torque plot: what the browser asks for at every zoom."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Query, Request
from fastapi.responses import Response

from api.pages.choices import ALL_SESSIONS, SessionChoice, VersionChoice, chosen_model, files_of_session
from api.pages.lru_cache import LruCache
from api.pages.rendering import PREFIX
from api.pages.stored_models import ShownModel, StoredExperiment
from api.service import access
from api.service.envelope import envelope, visible_rows

router = APIRouter(prefix=PREFIX, include_in_schema=False)

BETWEEN_SESSIONS = 2.0
"""s of empty time between sessions that are drawn end to end."""
_curves: LruCache[dict[str, np.ndarray]] = LruCache(8)


@router.get("/experiments/{experiment}/samples")
def samples_of_a_range(
    request: Request,
    _user: access.Viewer,
    experiment: str,
    joint: Annotated[str, Query(max_length=64)],
    version: Annotated[str, Query(max_length=12)],
    points: Annotated[int, Query(ge=2, le=20_000)],
    session: SessionChoice = ALL_SESSIONS,
    beside: VersionChoice = None,
    start: float | None = None,
    stop: float | None = None,
) -> Response:
    """Least and greatest values of the visible range, little-endian: the time origin as float64, rows and points as
    uint32, then float32 rows: time after the origin; measured, predicted, error; and, where a model stands beside,
    its predicted torque and its error. Of several sessions the header X-Sessions says where each begins, s, as JSON."""
    stored = StoredExperiment(access.service_of(request).experiments, experiment)
    shown = stored.model(version)
    other = chosen_model(stored, beside)
    joint = stored.joint_or_first(joint)
    files = files_of_session(stored, shown, other, session)
    time, signals = _visible(stored, shown, joint, files, start, stop)
    if other is not None:
        time_beside, behind = _visible(stored, other, joint, files, start, stop)
        if len(time_beside) == len(time):
            signals |= {f"{name} beside": behind[name] for name in ("predicted", "error")}
    headers = window_figures(signals)
    if len(files) > 1:
        begins = _end_to_end(stored, shown, joint, files)["begins"]
        headers["X-Sessions"] = json.dumps(
            [[float(begin), file] for begin, file in zip(begins, files, strict=True)]
        )
    origin, reduced = envelope(time, signals, points)
    head = np.array(origin, "<f8").tobytes() + np.array(reduced.shape, "<u4").tobytes()
    return Response(
        head + np.ascontiguousarray(reduced, "<f4").tobytes(),
        media_type="application/octet-stream",
        headers=headers,
    )


def window_figures(signals: Mapping[str, np.ndarray]) -> dict[str, str]:
    """Headers with the figures of the visible range, of the samples in which the joint moves: how many they are, the
    relative error, and the error's root mean square in the unit of the load. Nothing where nothing moves."""
    error = signals["error"]
    moving = ~np.isnan(error)
    samples = int(moving.sum())
    size = float(np.linalg.norm(signals["measured"][moving]))
    if not samples or not size:
        return {}
    left = float(np.linalg.norm(error[moving]))
    return {
        "X-Samples": str(samples),
        "X-Relative-Error": repr(left / size),
        "X-Error-RMS": repr(left / samples**0.5),
    }


def _visible(
    stored: StoredExperiment,
    model: ShownModel,
    joint: str,
    files: list[str],
    start: float | None,
    stop: float | None,
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Time (samples,) s of the visible range, and measured, predicted and error in it.

    Of one session only that range is read from the mapped file; several are put end to end once and kept.
    """
    if len(files) == 1:
        part = stored.stored_samples(model, joint, files)[files[0]]
        rows = visible_rows(part["time"], start, stop)
        seen = {name: part[name][rows] for name in ("time", "measured", "predicted", "moving")}
        error = _error(seen)
        return seen["time"], {"measured": seen["measured"], "predicted": seen["predicted"], "error": error}
    curves = _end_to_end(stored, model, joint, files)
    rows = visible_rows(curves["time"], start, stop)
    return curves["time"][rows], {name: curves[name][rows] for name in ("measured", "predicted", "error")}


def _end_to_end(
    stored: StoredExperiment, model: ShownModel, joint: str, files: list[str]
) -> dict[str, np.ndarray]:
    """`end_to_end` of several sessions, kept while they are looked at."""
    key: tuple[Path, str, tuple[str, ...]] = (model.folder, joint, tuple(files))
    return _curves.get(key, lambda: end_to_end(stored.stored_samples(model, joint, files)))


def _error(part: Mapping[str, np.ndarray]) -> np.ndarray:
    """Measured less predicted, (samples,); NaN where the joint rests."""
    error = np.asarray(part["measured"] - part["predicted"])
    error[part["moving"] == 0] = np.nan
    return error


def end_to_end(sessions: Mapping[str, Mapping[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Time (float64, s), measured, predicted and error (float32), (samples,) each; and (sessions,) where each begins, s.

    sessions : file -> column -> (samples,)

    The error is NaN where the joint rests: dry friction then takes any value, and such samples are no part of a fit.
    Several sessions follow one another with a pause of NaN between them, so that no line joins them.
    """
    pieces: dict[str, list[np.ndarray]] = {name: [] for name in ("time", "measured", "predicted", "error")}
    offset = 0.0
    begins: list[float] = []
    for stored in sessions.values():
        time = np.array(stored["time"])
        begins.append(offset)
        if not len(time):
            continue
        if len(sessions) > 1:
            time += offset - time[0]
        begins[-1] = float(time[0])
        measured, predicted = np.array(stored["measured"]), np.array(stored["predicted"])
        # As many empty rows as the pause has samples: a block of an envelope that lies in it holds nothing else.
        step = (time[-1] - time[0]) / max(len(time) - 1, 1) or BETWEEN_SESSIONS
        pause = np.arange(time[-1] + step, time[-1] + BETWEEN_SESSIONS, step)
        offset = float(time[-1]) + BETWEEN_SESSIONS
        pieces["time"] += [time, pause]
        signals = {"measured": measured, "predicted": predicted, "error": _error(stored)}
        for name, values in signals.items():
            pieces[name] += [values.astype(np.float32), np.full(len(pause), np.nan, np.float32)]
    joined = {name: np.concatenate(parts[:-1]) for name, parts in pieces.items()}
    return joined | {"begins": np.array(begins)}
