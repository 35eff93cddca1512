"""The verdict on a joint: missing, adequate, or unexplained."""

from collections.abc import Sequence

import numpy as np

from identify.diagnosis.finding import LEAST_OF_TORQUE
from identify.diagnosis.structure import Structure
from identify.results.diagnosis import Verdict

WITHOUT_MOTION = {"time", "frequency", "moments"}
"""Structure that comes and goes without regard to the motion, which a noise floor from repeats counts as noise."""
ABOVE_FLOOR = 1.5
"""An error this many times the noise floor leaves structure even where no predictor finds it (a hidden state)."""
AT_THE_FLOOR = 1.05
"""An error within this factor of the noise floor leaves nothing that depends on the motion."""
MOST = 0.5
"""More than half of it: of the error's power above the noise, which the missing effects must explain for the verdict to be
theirs; of what is left, which is predictable where what was added only imitates; and of what a free function takes away, which
an effect takes that is named although the rest is unexplained: the cause acts like it, but not quite."""
WORTH_SAYING = 0.15
"""Part of the first error's power above the noise that such a rest must have."""
MANY = 3
"""Effects on one joint that must together do as well as one free function to be believed rather than it."""
AS_WELL = 1.15
"""Factor within which an error is as good as another."""
BETTER = 0.97
"""The same for two effects of different variables: each has what the free function cannot know."""
CLEARLY_BETTER = 0.8
"""A free function with less than this part of the error of one or two effects shows that they imitate it. Where they
are the cause, their error is the noise, and nothing is clearly better."""

NEARLY_ALL = 0.9
"""Part of what a free function takes away with which an effect of the same variable is the cause, not its imitation: a
spring with a little play explains nine tenths as a straight line, one that acts on one side only two thirds at most."""
LARGE_PART = 0.8
"""The same where all the effects together do better than the free function."""


def imitated(after: float, free: float, missing: int, of_one_variable: bool, left_over: bool = False) -> bool:
    """Whether effects of the catalogue only imitate a dependence on one variable that it does not know.

    after           : relative held-out error with the missing effects
    free            : the same with the best free function of one variable instead
    of_one_variable : whether all the missing effects are functions of that same variable; then two of them are many
    left_over       : whether they leave something over it: of the cause there is nothing left, so that many imitate
    """
    several = missing >= MANY and (free < AS_WELL * after or (of_one_variable and left_over))
    together = missing > 1 and free < (1.0 if of_one_variable else BETTER) * after
    return missing > 0 and (free < CLEARLY_BETTER * after or several or together)


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


def acts_like(part: float, after: float, free: float) -> bool:
    """Whether effects are the cause although a free function would do: the strongest takes nearly all that the free
    function takes, or `LARGE_PART` of it where they do better together than the free function.

    part        : of the strongest effect, `part_of_free`
    after, free : relative held-out errors with all the effects, and with the free function instead
    """
    return part >= NEARLY_ALL or (part >= LARGE_PART and after < free)


def verdict(
    before: float, after: float, floor: float | None, structure: Sequence[Structure], missing: bool
) -> Verdict:
    """The contract's verdict.

    before, after : relative error of the joint without and with what is missing
    floor         : noise floor, if known
    structure     : what a predictor without any model finds in what is left, the most telling first
    """
    telling = [each for each in structure if each.found and each.share * after**2 >= LEAST_OF_TORQUE**2]
    if floor is not None and after < AT_THE_FLOOR * floor:
        telling = [each for each in telling if WITHOUT_MOTION & set(each.variables)]
    strongest = telling[0] if telling else None
    above = floor is not None and after > ABOVE_FLOOR * floor
    if not missing:
        return "unexplained" if strongest is not None or above else "adequate"
    share = min(strongest.share, 1.0) if strongest is not None else 0.0
    noise = after if floor is None else min(after, floor)
    if floor is None or (strongest is not None and WITHOUT_MOTION & set(strongest.variables)):
        noise = min(noise, after * float(np.sqrt(1 - share)))
    excess_before = max(before**2 - noise**2, 1e-300)
    excess_after = max(after**2 - noise**2, 0.0)
    explained = 1 - excess_after / excess_before
    mostly = share > MOST and excess_after > WORTH_SAYING * excess_before
    if (strongest is not None or above) and (explained < MOST or mostly):
        return "unexplained"
    return "missing"
