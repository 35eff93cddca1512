"""Whether the torque that the drives gave along a plan without feedforward is the model's, before the model's is sent.

The drive without feedforward torque measures what the plan needs: its current references. Joint by joint they are fitted, by
least squares over the plan, as

    measured = rigid * (torque of arm and payload) + beside * (friction and all else beside it) + noise

and beside that, with the torque of arm and payload as the model has it, as

    measured - torque of arm and payload = mass * (torque of a kilogram of payload) + beside * (...) + noise.

A right model has shares of 1 and no mass. Torque twice too large has shares of a half, friction of the wrong sign -1. A share
is known as well as it stays the same where an eighth of the plan is left out (the jackknife of J. W. Tukey), which holds for
coloured noise too.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_SHARE = 2.0 / 3.0
"""of a part of the model's torque: where less is needed, what is sent too much leaves the drive's loop half of what it had to
give without it, or more, with the sign turned round"""
SEGMENTS = 8
CERTAIN = 2.0
"""standard deviations"""


@dataclass(frozen=True)
class ModelTorque:
    """What a model says of a plan; a row for each of M cycles, N m or N.

    rigid    : (M, n) arm and payload
    beside   : (M, n) friction and all else
    kilogram : (M, n) what another kilogram of payload would add
    error    : (n,) root mean square up to which the model's torque is no other than the measured one
    mass     : kg, the payload
    """

    rigid: Array
    beside: Array
    kilogram: Array
    error: Array
    mass: float


@dataclass(frozen=True)
class _Share:
    """Least squares' factor of one column, and its standard deviation."""

    value: float
    deviation: float

    @property
    def lowest(self) -> float:
        return self.value - CERTAIN * self.deviation

    @property
    def highest(self) -> float:
        return self.value + CERTAIN * self.deviation

    def is_apart_from(self, value: float) -> bool:
        return not self.lowest <= value <= self.highest


def disagreements(measured: Array, model: ModelTorque, joints: Sequence[str]) -> list[str]:
    """Why the model's torque is not to be sent, in words; none where it is what was measured.

    measured : (M, n) N m or N, without feedforward torque
    """
    of_joints = [
        reason for joint, name in enumerate(joints) for reason in _of_joint(measured, model, joint, name)
    ]
    if of_joints:
        return of_joints
    more = _mass(measured, model)
    larger = max(model.mass, model.mass + more.value)
    if not more.is_apart_from(0.0) or abs(more.value) < (1.0 - LEAST_SHARE) * larger:
        return []
    weighs = max(0.0, model.mass + more.value)
    return [
        f"by the torque that was measured without feedforward the payload weighs {weighs:.2g} kg, give or take"
        f" {CERTAIN * more.deviation:.1g} kg, and {model.mass:.3g} kg was stated; check what is mounted"
    ]


def _of_joint(measured: Array, model: ModelTorque, joint: int, name: str) -> Iterator[str]:
    columns = np.column_stack([model.rigid[:, joint], model.beside[:, joint]])
    for what, share, size, most in zip(
        ("torque of arm and payload", "friction"),
        _shares(measured[:, joint], columns),
        _rms(columns),
        # friction that has grown takes its share and leaves the rest; gravity and inertia do not grow
        (1.0 / LEAST_SHARE, math.inf),
        strict=True,
    ):
        counts = abs(share.value - 1.0) * size > model.error[joint]
        if counts and (share.highest < LEAST_SHARE or share.lowest > most):
            bounds = f"at least {LEAST_SHARE:.2f}" if math.isinf(most) else f"{LEAST_SHARE:.2f} to {most:.2f}"
            yield (
                f"{name}: without feedforward the drive gave {share.value:.2f} times the model's {what} (give or take"
                f" {CERTAIN * share.deviation:.1g}); {bounds} times is a model of this machine"
            )


def _mass(measured: Array, model: ModelTorque) -> _Share:
    """kg more than was stated, of all joints that a payload loads; what the model may be off counts as deviation."""
    weight, sum_ = 0.0, 0.0
    rest = measured - model.rigid
    for joint, size in enumerate(_rms(model.kilogram)):
        columns = np.column_stack([model.kilogram[:, joint], model.beside[:, joint]])
        if size > 0.0:
            share = _shares(rest[:, joint], columns)[0]
            certainty = 1.0 / (share.deviation**2 + (model.error[joint] / size) ** 2)
            weight, sum_ = weight + certainty, sum_ + certainty * share.value
    return _Share(sum_ / weight, weight**-0.5) if weight > 0.0 else _Share(0.0, math.inf)


def _shares(measured: Array, columns: Array) -> list[_Share]:
    """Of each of the columns (M, k)."""
    values = _least_squares(columns, measured)
    place = np.arange(len(measured)) * SEGMENTS // max(len(measured), 1)
    without = np.array(
        [_least_squares(columns[place != out], measured[place != out]) for out in range(SEGMENTS)]
    )
    spread = np.sum((without - without.mean(axis=0)) ** 2, axis=0) * (SEGMENTS - 1) / SEGMENTS
    return [_Share(float(v), math.sqrt(s)) for v, s in zip(values, spread, strict=True)]


def _least_squares(columns: Array, measured: Array) -> Array:
    return np.asarray(np.linalg.lstsq(columns, measured, rcond=None)[0], np.float64)


def _rms(values: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(values**2, axis=0)), np.float64)
