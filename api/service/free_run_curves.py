"""Free runs as they are kept beside a fit: reduced to what a picture shows, for every session and joint."""

import io
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from api.service.envelope import envelope
from identify.recording.errors import InputError
from identify.simulation.free_motion import FreeMotion

POINTS = 1600
"""of one session: two for each column of pixels that a picture is wide"""

AFTERWARDS = 0.15
"""part of a run that is kept of the measured motion after both models' runs have ended, so that the picture is of the runs"""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MotionCurves:
    """Position or speed, (points,) rad or m, or a second; NaN where there is none: between stretches of a record with holes, and
    from where a run had ended.

    error, error_usual : the model's and the usual model's, less what was measured
    """

    measured: Array
    model: Array
    usual: Array
    error: Array
    error_usual: Array


SIGNALS = tuple(field.name for field in fields(MotionCurves))


@dataclass(frozen=True)
class FreeRunCurves:
    """One joint's free run in one session; of a long session least and greatest of a short time in turn.

    time : (points,) s into the session; NaN between stretches
    """

    time: Array
    position: MotionCurves
    speed: MotionCurves


def stored_runs(motions: Sequence[FreeMotion]) -> bytes:
    """A NumPy archive of all sessions: rows (1 + 10 n, points), time and then each joint's signals, of one behind the other."""
    by_file: dict[str, list[FreeMotion]] = {}
    for motion in motions:
        by_file.setdefault(motion.file, []).append(motion)
    parts = [_rows(stretches) for stretches in by_file.values()]
    written = io.BytesIO()
    np.savez_compressed(
        written,
        files=np.array(list(by_file)),
        ends=np.cumsum([part.shape[1] for part in parts]),
        rows=np.concatenate(parts, axis=1),
    )
    return written.getvalue()


def _rows(stretches: Sequence[FreeMotion]) -> NDArray[np.float32]:
    lasts = [_kept(each) for each in stretches]
    total = sum(lasts)
    parts: list[NDArray[np.float32]] = []
    for each, last in zip(stretches, lasts, strict=True):
        signals: dict[str, NDArray[np.float64]] = {}
        for joint in range(each.q.shape[1]):
            for kind, measured, model, usual in (
                ("q", each.q, each.model_q, each.usual_q),
                ("dq", each.dq, each.model_dq, each.usual_dq),
            ):
                of_usual = np.full(last, np.nan) if usual is None else usual[:last, joint]
                values = (measured[:last, joint], model[:last, joint], of_usual)
                errors = (values[1] - values[0], values[2] - values[0])
                signals |= {
                    f"{joint}-{kind}-{name}": column
                    for name, column in zip(SIGNALS, (*values, *errors), strict=True)
                }
        origin, rows = envelope(each.time[:last], signals, max(2, POINTS * last // total))
        rows[0] += np.float32(origin)
        parts += [rows, np.full((len(rows), 1), np.nan, np.float32)]
    return np.concatenate(parts[:-1], axis=1)


def _kept(motion: FreeMotion) -> int:
    """How many samples of a stretch are drawn."""
    runs = [motion.model_q] if motion.usual_q is None else [motion.model_q, motion.usual_q]
    ended = max(int(np.isfinite(run[:, 0]).sum()) for run in runs)
    return min(len(motion.time), ended + max(1, int(AFTERWARDS * ended)))


def read_runs(file: Path, session: str, joint: int) -> FreeRunCurves | None:
    """One joint of one session; None where there is no free run of it. Raises InputError where the file was damaged."""
    try:
        with file.open("rb") as opened, np.load(opened, allow_pickle=False) as held:
            files = [str(name) for name in held["files"]]
            if session not in files:
                return None
            place, ends = files.index(session), held["ends"]
            begin = int(ends[place - 1]) if place else 0
            rows = np.asarray(held["rows"][:, begin : int(ends[place])], np.float64)
    except FileNotFoundError:
        return None
    except (OSError, KeyError, ValueError, BadZipFile) as error:
        raise InputError(f"{file}: cannot be read ({error}); predict the motion again") from error
    count = len(SIGNALS)
    first = 1 + 2 * count * joint
    position, speed = rows[first : first + count], rows[first + count : first + 2 * count]
    return FreeRunCurves(rows[0], MotionCurves(*position), MotionCurves(*speed))
