"""The samples behind the torque plot: what the browser asks for at every zoom."""

import json
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Query
from fastapi.responses import Response
from numpy.typing import NDArray

from api.pages.choices import files_of_session
from api.pages.overlaid_sessions import overlaid
from api.pages.rendering import PREFIX
from api.pages.shown_samples import Shown, ShownSamples
from api.pages.stored_models import ShownModel
from api.pages.torque_curves import TorqueCurves, Window

router = APIRouter(prefix=PREFIX, include_in_schema=False)


@router.get("/experiments/{experiment}/samples")
def samples_of_a_range(
    shown: Shown,
    points: Annotated[int, Query(ge=2, le=20_000)],
    start: float | None = None,
    stop: float | None = None,
    overlay: Annotated[str | None, Query(max_length=255)] = None,
) -> Response:
    """Least and greatest values of the visible range, little-endian: the time origin as float64, rows and points as
    uint32, then float32 rows: time after the origin; measured, predicted, error; where a model stands beside, its predicted
    torque and its error; where another session is laid over the only one that is shown, its measured and predicted torque and
    error too, from the same beginning, of both models where two are shown. Where samples are chosen, one row is 1 at those.

    The header X-Curves names the rows after the time. Of several sessions X-Sessions says where each begins in the plot, s,
    its file, and what its own time is there, as JSON.
    """
    curves = TorqueCurves.of(shown.stored, shown.model, shown.joint, shown.files)
    if overlay and len(shown.files) == 1:
        # A session that the other model was not fitted with is refused, as where it stands alone.
        (over,) = files_of_session(shown.stored, shown.model, shown.beside, overlay)
        time, signals = _over_each_other(shown, over, start, stop, points)
        headers: dict[str, str] = {}
    else:
        window = curves.window(start, stop, points)
        time, signals = window.time, dict(window.curves)
        headers = window_figures(window)
        if shown.beside is not None:
            beside = TorqueCurves.of(shown.stored, shown.beside, shown.joint, shown.files)
            behind = beside.window(start, stop, points)
            if len(behind.time) == len(time):
                signals |= {f"{name} beside": behind.curves[name] for name in ("predicted", "error")}
        if shown.selection is not None:
            signals["chosen"] = window.marked(shown.chosen_of_file)
    headers["X-Curves"] = ",".join(signals)
    headers["X-Sessions"] = json.dumps(curves.beginnings)
    return Response(
        _packed(time, list(signals.values())), media_type="application/octet-stream", headers=headers
    )


def _over_each_other(
    shown: ShownSamples, over: str, start: float | None, stop: float | None, points: int
) -> tuple[NDArray, dict[str, NDArray]]:
    """The shown session and another one, of the shown model and of the one beside it."""
    (file,) = shown.files

    def curves(model: ShownModel, chosen: NDArray | None) -> tuple[NDArray, dict[str, NDArray]]:
        first, second = (
            shown.stored.stored_samples(model, shown.joint, [each])[each] for each in (file, over)
        )
        return overlaid(first, second, start, stop, points, chosen)

    time, signals = curves(shown.model, None if shown.selection is None else shown.chosen_of_file(file))
    if shown.beside is not None:
        behind_time, behind = curves(shown.beside, None)
        if len(behind_time) == len(time):
            names = ("predicted", "error", "predicted overlay", "error overlay")
            signals |= {f"{name} beside": behind[name] for name in names}
    return time, signals


def _packed(time: NDArray, rows: Sequence[NDArray]) -> bytes:
    origin = float(time[0]) if len(time) else 0.0
    table = np.stack([time - origin, *rows]).astype("<f4")
    head = np.array(origin, "<f8").tobytes() + np.array(table.shape, "<u4").tobytes()
    return head + np.ascontiguousarray(table).tobytes()


def window_figures(window: Window) -> dict[str, str]:
    """Headers with the figures of the visible range, of the samples in which the joint moves: how many they are, the
    relative error, and the error's root mean square in the unit of the load. Nothing where nothing moves."""
    sums = window.sums
    if not sums.samples or not sums.measured:
        return {}
    return {
        "X-Samples": str(int(sums.samples)),
        "X-Relative-Error": repr(sums.relative_error),
        "X-Error-RMS": repr(sums.rms(sums.error)),
    }
