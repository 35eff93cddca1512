"""The tables of relative errors: by speed as in the paper's Table III, by session, by payload and by quadrant."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from api.pages.joint_samples import JointSamples, relative_error

LOW_SPEED = 0.10
"""Fraction of the greatest speed up to which Table III calls samples slow."""
HIGH_SPEED = 0.35
"""Fraction of the greatest speed from which Table III calls samples fast."""


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


def by_speed(models: Sequence[JointSamples]) -> list[ErrorRow]:
    """Table III: all samples, 0 to 10 % and 35 to 100 % of the greatest speed."""
    greatest = float(models[0].speed.max(initial=0.0))
    rows: list[tuple[str, Callable[[JointSamples], np.ndarray]]] = [
        ("all samples", lambda samples: np.ones(samples.speed.shape, bool)),
        ("slow, 0 to 10 % of the greatest speed", lambda samples: samples.speed <= LOW_SPEED * greatest),
        ("fast, 35 to 100 %", lambda samples: samples.speed >= HIGH_SPEED * greatest),
    ]
    return [_row(label, models, choose) for label, choose in rows]


def by_power_sign(models: Sequence[JointSamples]) -> list[ErrorRow]:
    """Motor quadrants 1 and 3 against generator quadrants 2 and 4 of Fig. 2, by each model's own load."""
    return [
        _row("motor, quadrants 1 and 3", models, lambda samples: samples.load * samples.velocity > 0),
        _row("generator, quadrants 2 and 4", models, lambda samples: samples.load * samples.velocity < 0),
    ]


def by_payload(models: Sequence[JointSamples], payload_of: Mapping[str, str]) -> list[ErrorRow]:
    """One row for each payload, in the order of the sessions."""
    payloads = list(dict.fromkeys(payload_of[file] for file in models[0].files))
    rows = []
    present = set(models[0].session.tolist())
    for payload in payloads:
        indices = [index for index, file in enumerate(models[0].files) if payload_of[file] == payload]
        if not present.intersection(indices):
            continue
        rows.append(_row(payload, models, lambda samples, indices=indices: np.isin(samples.session, indices)))
    return rows


def by_session(models: Sequence[JointSamples]) -> list[ErrorRow]:
    """One row for each session file."""
    return [
        replace(_row(file, models, lambda samples, index=index: samples.session == index), session=file)
        for index, file in enumerate(models[0].files)
    ]


def _row(
    label: str, models: Sequence[JointSamples], choose: Callable[[JointSamples], np.ndarray]
) -> ErrorRow:
    masks = [choose(samples) for samples in models]
    errors = tuple(
        relative_error(samples.measured[mask], samples.error[mask])
        for samples, mask in zip(models, masks, strict=True)
    )
    return ErrorRow(label, int(masks[0].sum()), errors)
