"""What the motion of a record can tell of a model: a verdict of its own, before anybody reads a parameter."""

from collections.abc import Sequence

from identify.effects.motion import JointSummary
from identify.estimation.doubts import cancels, predicts_worse
from identify.estimation.identified import Identified
from identify.estimation.parameters import Parameter, column_names
from identify.results.identification import Excitation

UNTOLD = 0.5
"""Deviation in parts of the value above which zero is inside two deviations: the motion does not tell it from nothing."""


def excitation(result: Identified) -> Excitation:
    """What the sessions of the fit show of the model, and what they do not."""
    fitted = result.fitted
    names = [name for name, *_ in column_names(fitted)]
    grave: list[str] = []
    worse = predicts_worse(fitted, result.relative_error, result.relative_error_validation)
    if worse:
        grave.append(worse)
    grave += [
        f"only the sum of {names[first]} and {names[second]} is seen" for first, second in cancels(fitted)
    ]
    dropped = [names[column] for column in fitted.fit.dropped]
    slight = [f"{', '.join(dropped)}: nothing in this motion shows them"] if dropped else []
    untold = undetermined(result.parameters)
    if untold:
        slight.append(
            f"{', '.join(untold)}: zero, or not determined by this motion (within two deviations of zero)"
        )
    slight += _obstacles(result)
    verdict = "insufficient" if grave else "partial" if slight else "sufficient"
    return Excitation(verdict=verdict, cannot_tell=(*grave, *slight))


def undetermined(parameters: Sequence[Parameter]) -> list[str]:
    """Names of the parameters that two deviations do not tell from zero: those for coloured residuals or, of a record too
    short to tell their colour, those of eq. (13)-(15)."""
    names = []
    for parameter in parameters:
        deviation = parameter.std if parameter.std_robust is None else parameter.std_robust
        if deviation is not None and deviation > UNTOLD * abs(parameter.value):
            names.append(parameter.name)
    return names


def _obstacles(result: Identified) -> list[str]:
    """What the motion lacks for the effects of the model, joint by joint."""
    record = result.fitted.record
    by_reason: dict[str, list[str]] = {}
    for term in result.effects:
        summary: JointSummary = record.summaries[term.joint]
        obstacle = term.effect.obstacle(summary)
        if obstacle is not None:
            remedy = f"; {obstacle.remedy}" if obstacle.remedy else ""
            effect = f"{term.effect.name}@{summary.name}"
            by_reason.setdefault(f"{obstacle.reason}{remedy}", []).append(effect)
    return [f"{', '.join(effects)}: {reason}" for reason, effects in by_reason.items()]
