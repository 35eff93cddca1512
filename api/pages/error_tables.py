"""The tables of relative errors: by speed as in the paper's Table III, by session, by payload and by quadrant.

They are made of sums over every sample, of one model at a time; samples are read once, in pieces.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from api.pages.joint_samples import JointSamples
from api.service.stored_samples import StoredSamples
from api.service.torque_outline import Sums

LOW_SPEED = 0.10
"""Fraction of the greatest speed up to which Table III calls samples slow."""
HIGH_SPEED = 0.35
"""Fraction of the greatest speed from which Table III calls samples fast."""
PIECE = 1 << 16
"""samples that are looked at together, however long a session is"""


@dataclass(frozen=True)
class ErrorSums:
    """Of one model's samples in which a joint moves.

    sessions : by file, of all that are shown
    slow, fast, motor, generator : of the sessions in the fit; of all where none of these is shown
    """

    sessions: dict[str, Sums]
    slow: Sums
    fast: Sums
    motor: Sums
    generator: Sums


@dataclass(frozen=True)
class ErrorRow:
    """One row: the words for the samples taken, how many, and the relative error of each model (None: no samples).

    session : file of the session whose samples they are, in the table by session
    """

    words: str
    samples: int
    errors: tuple[float | None, ...]
    session: str | None = None

    @property
    def best(self) -> int | None:
        """Index of the smallest error where the models differ."""
        given = [(error, index) for index, error in enumerate(self.errors) if error is not None]
        return min(given)[1] if len(given) > 1 else None


def files_in_fit(files: Sequence[str], fitted: Collection[str]) -> list[str]:
    """Those of the files that the fit was made of; all where it was made of none of them."""
    return [file for file in files if file in fitted] or list(files)


def error_sums(parts: Mapping[str, StoredSamples], used: Collection[str]) -> ErrorSums:
    """Of the stored samples of some sessions.

    used : files of the sessions in the fit
    """
    greatest = max((_greatest_speed(part) for file, part in parts.items() if file in used), default=0.0)
    sessions = {}
    # (3 sums, speed: slow, between, fast, power: of the load, none, of the motor)
    table = np.zeros((3, 3, 3))
    for file, part in parts.items():
        of_session = np.zeros((3, 3, 3))
        for rows in _pieces(part):
            moving = np.flatnonzero(part.moves(rows))
            velocity, load, measured, predicted = (
                np.asarray(column[rows])[moving]
                for column in (part.velocity, part.load, part.measured, part.predicted)
            )
            speed = np.abs(velocity)
            kind = 3 * (
                1 + (speed >= HIGH_SPEED * greatest).astype(int) - (speed <= LOW_SPEED * greatest)
            ) + (1 + np.sign(load * velocity).astype(int))
            weights = (None, np.square(measured), np.square(measured - predicted))
            of_session += np.stack([np.bincount(kind, each, minlength=9) for each in weights]).reshape(
                3, 3, 3
            )
        sessions[file] = Sums(*of_session.sum(axis=(1, 2)).tolist())
        if file in used:
            table += of_session
    slow, fast = (Sums(*table[:, place].sum(axis=1).tolist()) for place in (0, 2))
    generator, motor = (Sums(*table[:, :, place].sum(axis=1).tolist()) for place in (0, 2))
    return ErrorSums(sessions, slow, fast, motor, generator)


def sums_of(samples: JointSamples) -> dict[str, Sums]:
    """By file, of samples at hand."""
    weights = (None, np.square(samples.measured), np.square(samples.error))
    sums = np.stack([np.bincount(samples.session, each, minlength=len(samples.files)) for each in weights])
    return {
        file: Sums(*of_file)
        for file, of_file in zip(samples.files, sums.T.astype(float).tolist(), strict=True)
    }


def together(sums: Mapping[str, Sums], files: Collection[str]) -> Sums:
    """Of some of the sessions."""
    return sum((each for file, each in sums.items() if file in files), Sums())


def by_speed(models: Sequence[ErrorSums], used: Collection[str]) -> list[ErrorRow]:
    """Table III: all samples, 0 to 10 % and 35 to 100 % of the greatest speed."""
    return [
        _row("all", [together(each.sessions, used) for each in models]),
        _row("slow, 0 to 10 % of the greatest speed", [each.slow for each in models]),
        _row("fast, 35 to 100 %", [each.fast for each in models]),
    ]


def by_power_sign(models: Sequence[ErrorSums]) -> list[ErrorRow]:
    """Motor quadrants 1 and 3 against generator quadrants 2 and 4 of Fig. 2, by each model's own load."""
    return [
        _row("motor, quadrants 1 and 3", [each.motor for each in models]),
        _row("generator, quadrants 2 and 4", [each.generator for each in models]),
    ]


def by_payload(
    models: Sequence[Mapping[str, Sums]], payload_of: Mapping[str, str], files: Collection[str]
) -> list[ErrorRow]:
    """One row for each payload of which the sessions in `files` have samples, in the order of the sessions.

    models : sums by file
    """
    rows = []
    for payload in dict.fromkeys(payload_of[file] for file in models[0]):
        of_payload = [file for file in files if payload_of[file] == payload]
        row = _row(payload, [together(each, of_payload) for each in models])
        rows += [row] if row.samples else []
    return rows


def by_session(models: Sequence[ErrorSums], fitted: Collection[str]) -> list[ErrorRow]:
    """One row for each session file; of those that the fit was not made of it is said, and no other view shows them."""
    rows = []
    for file in models[0].sessions:
        title = file if file in fitted else f"{file} (validation)"
        row = _row(title, [each.sessions[file] for each in models])
        rows.append(replace(row, session=file if file in fitted else None))
    return rows


def _row(title: str, sums: Sequence[Sums]) -> ErrorRow:
    return ErrorRow(title, int(sums[0].samples), tuple(each.relative_error for each in sums))


def _pieces(part: StoredSamples) -> list[slice]:
    count = part.count
    return [slice(start, min(start + PIECE, count)) for start in range(0, count, PIECE)]


def _greatest_speed(part: StoredSamples) -> float:
    """rad/s or m/s, of the samples in which the joint moves."""
    greatest = 0.0
    for rows in _pieces(part):
        speed = np.abs(np.asarray(part.velocity[rows]))[part.moves(rows)]
        greatest = max(greatest, float(speed.max(initial=0.0)))
    return greatest
