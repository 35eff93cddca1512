"""The verdict on a joint: missing, adequate, or unexplained."""

from collections.abc import Sequence

import numpy as np

from identify.diagnosis.deciding_constants import LEAST_OF_TORQUE, MOST
from identify.diagnosis.structure import Structure
from identify.results.diagnosis import Verdict
from identify.validation.noise_floor import NoiseFloor

WITHOUT_MOTION = {"time", "frequency", "moments"}
"""Structure that comes and goes without regard to the motion, which a noise floor from repeats counts as noise."""


def imitated(
    after: float,
    free: float,
    missing: int,
    of_one_variable: bool,
    left_over: bool = False,
    lead: float = 0.0,
) -> bool:
    """Whether effects of the catalogue only imitate a dependence on one variable that it does not know.

    after           : relative held-out error with the missing effects
    free            : the same with the best free function of one variable instead
    of_one_variable : whether all the missing effects are functions of that same variable
    left_over       : whether they leave something over it: of the cause there is nothing left, so that several imitate
    lead            : by how much the square of `free` must be less than that of `after`, for the parameters it has more

    Several effects are believed if together they do better than one free function, or as well with fewer parameters.
    """
    several = missing > 1 and (after**2 - free**2 > lead or (of_one_variable and left_over))
    return missing > 0 and (free**2 < MOST * after**2 or several)


def left_over(variable: str, structure: Sequence[Structure], after: float) -> bool:
    """Whether a predictor finds something over one variable, or it and the direction of motion, that is no rounding.

    after : relative error that the structure is a part of
    """
    return any(
        each.found
        and variable in each.variables
        and set(each.variables) <= {variable, "direction"}
        and each.share * after**2 >= LEAST_OF_TORQUE**2
        for each in structure
    )


def part_of_free(before: float, after: float, free: float) -> float:
    """How much of what a free function of its variable takes away an effect takes away; of squared errors.

    before, after, free : relative held-out errors without either, with the effect, with the free function; where the
                          free function takes nothing away, the effect has no part in it
    """
    return max(0.0, before**2 - after**2) / (before**2 - free**2) if free < before else 0.0


def verdict(
    before: float, after: float, floor: NoiseFloor | None, structure: Sequence[Structure], missing: bool
) -> Verdict:
    """The contract's verdict.

    before, after : relative error of the joint without and with what is missing
    floor         : noise floor, if known
    structure     : what a predictor without any model finds in what is left, the most telling first
    """
    telling = [each for each in structure if each.found and each.share * after**2 >= LEAST_OF_TORQUE**2]
    if floor is not None and after <= floor.high:  # nothing that depends on the motion is left
        telling = [each for each in telling if WITHOUT_MOTION & set(each.variables)]
    strongest = telling[0] if telling else None
    above = floor is not None and after**2 - floor.value**2 > MOST * after**2
    if not missing:
        return "unexplained" if strongest is not None or above else "adequate"
    share = min(strongest.share, 1.0) if strongest is not None else 0.0
    noise = after if floor is None else min(after, floor.value)
    if floor is None or (strongest is not None and WITHOUT_MOTION & set(strongest.variables)):
        noise = min(noise, after * float(np.sqrt(1 - share)))
    excess_before = max(before**2 - noise**2, 1e-300)
    excess_after = max(after**2 - noise**2, 0.0)
    explained = 1 - excess_after / excess_before
    if (strongest is not None or above) and explained < MOST:
        return "unexplained"
    return "missing"
