"""What the motion of a record can tell of a model: a verdict of its own, before anybody reads a parameter."""

from identify.effects.motion import JointSummary
from identify.estimation.doubts import cancels, predicts_worse
from identify.estimation.identified import Identified
from identify.estimation.parameters import column_names
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
    untold = [
        parameter.name
        for parameter in result.parameters
        if parameter.std_robust is not None and parameter.std_robust > UNTOLD * abs(parameter.value)
    ]
    if untold:
        slight.append(
            f"{', '.join(untold)}: zero, or not determined by this motion (within two deviations of zero)"
        )
    slight += _obstacles(result)
    verdict = "insufficient" if grave else "partial" if slight else "sufficient"
    return Excitation(verdict=verdict, cannot_tell=(*grave, *slight))


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
