"""Measured and predicted torque of one model over some sessions, end to end, reduced to what a plot shows of a range."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from api.pages.lru_cache import LruCache
from api.pages.stored_models import ShownModel, StoredExperiment
from api.service.envelope import visible_rows
from api.service.stored_samples import StoredSamples
from api.service.torque_outline import CURVES, Reduced, Sums, reduced, sums

Array = NDArray[np.float64]

BETWEEN_SESSIONS = 2.0
"""s of empty time between sessions that are drawn end to end."""
_outlines: LruCache[dict[str, Array]] = LruCache(32)


@dataclass(frozen=True)
class Window:
    """What is visible of some sessions.

    time   : (points,) s, of the plot
    curves : measured, predicted, error, (points,) each; NaN between sessions, so that no line joins them
    sums   : of the samples in the range
    pieces : file -> its own part, and which of its rows that is
    """

    time: Array
    curves: dict[str, Array]
    sums: Sums
    pieces: dict[str, tuple[Reduced, slice]]

    def marked(self, chosen: Callable[[str], NDArray[np.bool_]]) -> Array:
        """(points,) 1 where `chosen(file)`, (samples,) of a whole session, is true in a point, else NaN."""
        parts: list[Array] = []
        for file, (part, rows) in self.pieces.items():
            parts += [part.marked(chosen(file)[rows], rows), np.full(1, np.nan)]
        return np.concatenate(parts[:-1]) if parts else np.zeros(0)


@dataclass(frozen=True)
class TorqueCurves:
    """The stored samples of some sessions and their outlines, by file."""

    parts: Mapping[str, StoredSamples]
    outlines: Mapping[str, Array]

    @classmethod
    def of(cls, stored: StoredExperiment, model: ShownModel, joint: str, files: list[str]) -> "TorqueCurves":
        """Of a fit. Raises the problem 404 if a session has no samples."""
        key = (model.folder, joint, tuple(files))
        return cls(
            stored.stored_samples(model, joint, files),
            _outlines.get(key, lambda: stored.outlines(model, joint, files)),
        )

    @cached_property
    def beginnings(self) -> list[tuple[float, str, float]]:
        """Where each session begins in the plot, s; its file; and what its own time is there, s."""
        begins, offset = [], 0.0
        several = len(self.parts) > 1
        for file, part in self.parts.items():
            time = part.time
            first = float(time[0]) if len(time) else 0.0
            begin = offset if several else first
            begins.append((begin, file, first))
            if len(time):
                offset = begin + float(time[-1]) - first + BETWEEN_SESSIONS
        return begins

    def window(self, start: float | None, stop: float | None, points: int) -> Window:
        """The range from `start` to `stop`, s of the plot (None: from the beginning, to the end), in about `points`."""
        visible: dict[str, slice] = {}
        for begin, file, first in self.beginnings:
            time = self.parts[file].time
            after = first - begin
            rows = visible_rows(
                time, None if start is None else start + after, None if stop is None else stop + after
            )
            if rows.stop - rows.start > 1 or len(self.parts) == 1:
                visible[file] = rows
        total = max(sum(rows.stop - rows.start for rows in visible.values()), 1)
        pieces: dict[str, tuple[Reduced, slice]] = {}
        of_all = Sums()
        for file, rows in visible.items():
            share = points * (rows.stop - rows.start) // total - (
                2 if len(visible) > 1 and total > points else 0
            )
            pieces[file] = reduced(self.parts[file], self.outlines[file], rows, max(share, 2))
            of_all += sums(self.parts[file], self.outlines[file], rows)
        return Window(*self._joined(pieces), of_all, pieces)

    def _joined(self, pieces: Mapping[str, tuple[Reduced, slice]]) -> tuple[Array, dict[str, Array]]:
        """Sessions one after the other, with an empty point in each pause."""
        at = {file: begin - first for begin, file, first in self.beginnings}
        times: list[Array] = []
        curves: dict[str, list[Array]] = {name: [] for name in CURVES}
        for file, (part, _) in pieces.items():
            time = part.time + at[file]
            end = float(time[-1]) if len(time) else 0.0
            times += [time, np.array([end + BETWEEN_SESSIONS / 2])]
            for name in CURVES:
                curves[name] += [part.curves[name], np.full(1, np.nan)]
        if not times:
            return np.zeros(0), {name: np.zeros(0) for name in CURVES}
        return np.concatenate(times[:-1]), {name: np.concatenate(each[:-1]) for name, each in curves.items()}
