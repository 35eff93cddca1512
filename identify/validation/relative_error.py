"""How well a model predicts: the relative error ‖Y − Wχ‖ / ‖Y‖ and its parts (Tables III and IV)."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimation.block_errors import ratio
from identify.estimation.prediction import Prediction
from identify.recording import SessionEntry
from identify.results.identification import JointSpeedError, PayloadError, Role, SpeedError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SpeedRange:
    """A range of |dq| in parts of a joint's top speed."""

    name: str
    low: float
    high: float


SPEED_RANGES = (
    SpeedRange("all", 0.0, np.inf),
    SpeedRange("low", 0.0, 0.1),
    SpeedRange("high", 0.35, np.inf),
)
"""Table III: all speeds, 0 to 10 % and 35 to 100 % of the maximum."""


def squares_in(speed: SpeedRange, prediction: Prediction, top_speed: float) -> Array:
    """(3,): squared norms of residual and measured torque, and samples, of the moving samples in a speed range."""
    share = np.abs(prediction.velocity) / max(top_speed, 1e-300)
    chosen = prediction.moving & (share >= speed.low) & (share <= speed.high)
    residual, measured = prediction.residual[chosen], prediction.measured[chosen]
    return np.array([residual @ residual, measured @ measured, float(chosen.sum())])


def by_speed(groups: dict[str, list[Prediction]], top_speed: dict[str, float]) -> tuple[SpeedError, ...]:
    """Table III: relative errors in the ranges of speed, in all and for each joint.

    groups    : predictions of the sessions of a role, e.g. {"identification": …, "validation": …}
    top_speed : of each joint, rad/s or m/s
    """
    errors = []
    for speed in SPEED_RANGES:
        training, checked = (
            {joint: np.zeros(3) for joint in top_speed} for _ in ("identification", "validation")
        )
        for role, table in (("identification", training), ("validation", checked)):
            for prediction in groups.get(role, ()):
                table[prediction.joint] += squares_in(speed, prediction, top_speed[prediction.joint])
        whole, unseen = (np.sum(list(table.values()), axis=0) for table in (training, checked))
        errors.append(
            SpeedError(
                range=speed.name,
                from_=speed.low,
                to=min(speed.high, 1.0),
                relative_error=ratio(whole[0], whole[1]),
                relative_error_validation=ratio(unseen[0], unseen[1]),
                samples=int(whole[2]),
                joints=tuple(
                    JointSpeedError(
                        joint=joint,
                        relative_error=ratio(training[joint][0], training[joint][1]),
                        relative_error_validation=ratio(checked[joint][0], checked[joint][1]),
                        samples=int(training[joint][2]),
                    )
                    for joint in top_speed
                ),
            )
        )
    return tuple(errors)


def by_payload(
    sessions: list[tuple[SessionEntry, Role, Array]], unknown: Collection[str] = ()
) -> tuple[PayloadError, ...]:
    """Relative error of each payload in each role.

    sessions : entry, how it was used, and its squared norms (residual, measured)
    unknown  : names of payloads whose mass is not taken as declared
    """
    sums: dict[tuple[str, Role], Array] = {}
    masses: dict[str, float | None] = {}
    for entry, role, squares in sessions:
        key = (entry.payload.name, role)
        sums[key] = sums.get(key, np.zeros(2)) + squares
        masses[entry.payload.name] = None if entry.payload.name in unknown else entry.payload.mass
    return tuple(
        PayloadError(payload=payload, mass=masses[payload], role=role, relative_error=ratio(*squares))
        for (payload, role), squares in sums.items()
    )
