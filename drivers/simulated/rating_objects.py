"""What a simulated drive says of its motor, its limits and its encoder: objects of CiA 402 whose values its settings give."""

import math
from collections.abc import Mapping, Sequence

from drivers.simulated.settings import SimulatedAxis


def rating_objects(axis: SimulatedAxis) -> dict[tuple[int, int], int]:
    """Value of each object by (index, subindex), in the object's own unit."""
    limit = round(axis.current_limit * 1000)  # of the rated current, ‰
    return {
        (0x6072, 0): limit,  # max torque
        (0x6073, 0): limit,  # max current
        (0x6075, 0): round(axis.rated_current * 1e3),  # mA
        (0x6076, 0): round(axis.rated_torque * 1e3),  # mN m
        (0x6065, 0): round(axis.following_error * axis.counts_per_turn),
        (0x6066, 0): round(axis.following_error_time * 1e3),  # ms
        (0x6080, 0): round(axis.max_speed * 60 / math.tau),  # rev/min
        (0x6085, 0): round(axis.quick_stop_deceleration * axis.counts_per_radian),  # counts/s²
        (0x6099, 1): round(0.2 * axis.counts_per_turn),  # homing speed, counts/s
        (0x608F, 1): axis.counts_per_turn,  # encoder increments
        (0x608F, 2): 1,  # per revolution of the motor
    }


def tuning_objects(
    gains: Mapping[int, int], tables: Mapping[int, Sequence[int]]
) -> dict[tuple[int, int], int]:
    """Index and subindex of the servo's gains and of the compensation's tables, with their raw values."""
    objects = {(index, 0): value for index, value in gains.items()}
    for index, values in tables.items():
        for place, value in enumerate(values, 1):
            objects[index, 0 if len(values) == 1 else place] = value
    return objects
