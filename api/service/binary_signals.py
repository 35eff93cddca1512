"""Signals as they travel to a plot: an envelope as float32, with what it means in the headers."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from starlette.responses import Response

from api.service.envelope import envelope, visible_rows

MEDIA_TYPE = "application/octet-stream"


def signals_response(
    time: NDArray[np.float64],
    signals: Mapping[str, NDArray],
    start: float | None,
    end: float | None,
    points: int,
) -> Response:
    """The visible range of signals (N,), reduced to at most `points` rows.

    The body is float32, little-endian, column by column: time less X-Time-Origin (s), then the signals in
    the order of X-Columns; X-Rows says how many each. More than `points` samples come as pairs of smallest
    and largest value.
    """
    rows = visible_rows(time, start, end)
    origin, values = envelope(time[rows], {name: each[rows] for name, each in signals.items()}, points)
    headers = {
        "X-Time-Origin": repr(origin),
        "X-Columns": ",".join(["time", *signals]),
        "X-Rows": str(values.shape[1]),
        "X-Samples": str(rows.stop - rows.start),
        "Cache-Control": "private, no-cache",
    }
    return Response(np.ascontiguousarray(values, "<f4").tobytes(), media_type=MEDIA_TYPE, headers=headers)
