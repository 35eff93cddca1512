"""Any two columns of the samples against each other: what the page's plot asks for."""

import json
from dataclasses import asdict, dataclass
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Depends, Query
from fastapi.responses import Response
from numpy.typing import NDArray

from api.pages.rendering import PREFIX
from api.pages.sample_columns import LONGEST_NAME, Column
from api.pages.shown_samples import Shown
from api.service.pair_thinning import thinned_pairs

router = APIRouter(prefix=PREFIX, include_in_schema=False)

Array = NDArray[np.float64]
ColumnName = Annotated[str, Query(max_length=LONGEST_NAME)]
Cells = Annotated[int, Query(ge=8, le=400)]


@dataclass(frozen=True)
class Seen:
    """The ranges that are seen, in the columns' units; None: to the end of the data."""

    x_from: float | None = None
    x_to: float | None = None
    y_from: float | None = None
    y_to: float | None = None

    def of(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Both columns (samples,), NaN where a sample is not seen."""
        if self == Seen():
            return x, y
        seen = np.ones(len(x), bool)
        for values, low, high in ((x, self.x_from, self.x_to), (y, self.y_from, self.y_to)):
            if low is not None:
                seen &= values >= low
            if high is not None:
                seen &= values <= high
        return np.where(seen, x, np.nan), np.where(seen, y, np.nan)


@router.get("/experiments/{experiment}/columns")
def columns_of_the_record(shown: Shown) -> list[Column]:
    """Columns that only the record has; it is read for that."""
    return shown.columns.further()


@router.get("/experiments/{experiment}/pairs")
def pairs(
    shown: Shown,
    x: ColumnName,
    y: ColumnName,
    seen: Annotated[Seen, Depends(Seen)],
    across: Cells = 160,
    up: Cells = 100,
) -> Response:
    """Samples that stand for all in a plot of `across` by `up` cells, little-endian: rows and points as uint32, then float32
    rows: x, y, time in the session, number of the session from 0, samples in the point's cell, 1 where it is chosen.

    The header X-Pairs is JSON: both columns, the sessions' files, how many samples there are, and how many are seen.
    """
    of_x, of_y = shown.columns.column(x), shown.columns.column(y)
    samples = shown.stored.samples(shown.model, shown.joint, shown.counted).in_fit
    along, upward = (np.asarray(shown.columns.in_fit(name), dtype=float) for name in (x, y))
    all_samples = _finite(along, upward)
    along, upward = seen.of(along, upward)
    mask = shown.chosen_of_fit()
    thinned = thinned_pairs(along, upward, across, up)
    rows, count = thinned.rows, thinned.count
    if (
        mask.any()
    ):  # the chosen ones are thinned by themselves, so that none of their outliers is lost behind others
        among = np.flatnonzero(mask)
        part = thinned_pairs(along[among], upward[among], across, up)
        rows = np.concatenate([rows[~mask[rows]], among[part.rows]])
        count = np.concatenate([count[~mask[thinned.rows]], part.count])
    table = np.stack(
        [along[rows], upward[rows], samples.time[rows], samples.session[rows], count, mask[rows]]
    ).astype("<f4")
    header = {
        "x": asdict(of_x),
        "y": asdict(of_y),
        "files": list(samples.files),
        "samples": all_samples,
        "seen": _finite(along, upward),
    }
    body = np.array(table.shape, "<u4").tobytes() + np.ascontiguousarray(table).tobytes()
    return Response(body, media_type="application/octet-stream", headers={"X-Pairs": json.dumps(header)})


def _finite(x: Array, y: Array) -> int:
    return int(np.sum(np.isfinite(x) & np.isfinite(y)))
