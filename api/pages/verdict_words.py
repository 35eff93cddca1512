"""The verdict of a diagnosis in one sentence, and what stands behind it, in an operator's words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from api.pages.error_figures import JointUnits
from api.pages.number_format import THIN, listing, number, percent, significant
from identify.results.diagnosis import Candidate, JointDiagnosis, Where

VARIABLE_WORDS = {
    "dq": ("speed", "speed"),
    "velocity": ("speed", "speed"),
    "speed": ("speed", "speed"),
    "q": ("position", "position"),
    "position": ("position", "position"),
    "ddq": ("acceleration", "acceleration"),
    "acceleration": ("acceleration", "acceleration"),
    "load": ("load", "load"),
    "time": ("time", "time"),
    "temperature": ("temperature", "temperature"),
    "travel since reversal": ("travel", "position"),
}
"""Variable of `where` in the contract's JSON -> words, and the dimension that its unit follows from."""

STRUCTURE_WORDS = {
    "direction": "direction",
    "history": "the motion of the last second",
    "frequency": "a frequency that does not follow the motion",
    "travel since reversal": "travel since the last reversal",
}
"""What structure is found in -> words, where they are not those of the variable."""

OF_JOINT = " of "
"""Between a variable and the neighbouring joint whose it is."""


@dataclass(frozen=True)
class Verdict:
    """`kind` is the contract's verdict, or `unknown` before the first diagnosis."""

    kind: str
    sentence: str
    detail: str


def verdict_of(joint: JointDiagnosis | None, floor: float | None, titles: Mapping[str, str]) -> Verdict:
    """Put the diagnosis of one joint into words; `titles` are names of effects as a person says them."""
    if joint is None:
        return Verdict(
            "unknown",
            "Not diagnosed yet.",
            "Find what is missing: the model is tried with every effect of the catalogue on motion it did not see.",
        )
    if joint.verdict == "missing":
        names = [titles.get(name, name) for name in joint.missing]
        return Verdict("missing", f"The model misses {_listed(names)}.", _gain_words(joint))
    if joint.verdict == "adequate":
        rest = "No effect of the catalogue lowers the error on motion that the fit did not see by enough to count."
        if floor is not None:
            rest = f"The noise floor is {percent(floor)}. {rest}"
        return Verdict("adequate", "Nothing is missing: what is left is noise.", rest)
    look = "The error has structure; below is where it sits. Look at the machine there, or describe an effect of your own."
    names = [titles.get(name, name) for name in joint.missing]
    return Verdict(
        "unexplained",
        "Something is left that no effect of the catalogue explains.",
        f"{look} A part of it looks like {_listed(names)}." if names else look,
    )


def _listed(names: Sequence[str]) -> str:
    """Up to three names; more make no sentence, and stand one by one below it."""
    return listing(names) if len(names) <= 3 else f"{', '.join(names[:2])} and {len(names) - 2} more effects"


def unseen_error(joint: JointDiagnosis | None) -> float | None:
    """The model's error on motion that the fit did not see, part of the measured torque; None where it was not diagnosed.

    Candidates stand beside the model, a few only beside the missing effects, which make the error smaller.
    """
    errors = [each.heldout_error_before for each in joint.candidates] if joint else []
    return max((each for each in errors if each is not None), default=None)


def _gain_words(joint: JointDiagnosis) -> str:
    steps = joint.evidence
    if len(steps) > 1:  # each beside all the others: with it, all of them are there
        return (
            f"With all of them the error on motion that the fit did not see falls from "
            f"{percent(unseen_error(joint))} to {percent(steps[0].heldout_error_after)}."
        )
    first = next((each for each in joint.candidates if each.effect in joint.missing), None)
    if first is None:
        return ""
    return (
        f"With it the error on motion that the fit did not see falls from {percent(first.heldout_error_before)} "
        f"to {percent(first.heldout_error_after)}."
    )


def structure_words(joint: JointDiagnosis | None) -> str | None:
    """What a predictor without any model still finds in what is left, in one sentence; None where that is noise."""
    strongest = None if joint is None else next((each for each in joint.structure if each.found), None)
    if joint is None or strongest is None:
        return None
    names = [_structure_name(name) for name in strongest.variables]
    beyond = " with the missing effects added" if joint.missing else ""
    if strongest.variables == ("moments",):
        return (
            f"{percent(strongest.share, 2)} of the power that is left{beyond} lies in a few moments that stand out from "
            "the rest, away from reversals: look at what happened then."
        )
    shared = any(OF_JOINT in name for name in strongest.variables)
    return (
        f"{percent(strongest.share, 2)} of the power that is left{beyond} can be predicted from {listing(names)}, "
        "without any model: it is not noise."
        + (" It looks like friction of a motor or a belt that both joints share." if shared else "")
    )


def _structure_name(name: str) -> str:
    """`dq of j2` becomes `speed of j2`."""
    variable, of, joint = name.partition(OF_JOINT)
    return STRUCTURE_WORDS.get(variable, VARIABLE_WORDS.get(variable, (variable, ""))[0]) + of + joint


def where_words(place: Where, units: JointUnits) -> str:
    """`speed −0.1 to 0.1 rad/s`."""
    text, dimension = VARIABLE_WORDS.get(place.variable, (place.variable, ""))
    low, high = place.from_, place.to
    if place.variable == "session":
        return f"{text} {number(low, 0)}"
    unit = f"{THIN}{units.of_dimension(dimension)}" if dimension else ""
    if place.label is not None:  # a stretch of one session, which lasts as short as a blow
        return f"{text} {number(low, 1)} to {number(high, 1)}{unit} of {place.label}"
    return f"{text} {significant(low, 2)} to {significant(high, 2)}{unit}"


def rival_words(
    candidates: Sequence[Candidate], titles: Mapping[str, str], missing: Sequence[str]
) -> list[str]:
    """One sentence for each candidate (of those that matter) that others explain alike."""
    sentences = []
    seen: set[frozenset[str]] = set()
    for candidate in candidates:
        rivals = candidate.indistinguishable_from
        group = frozenset([candidate.effect, *rivals])
        if not rivals or group in seen or (missing and candidate.effect not in missing):
            continue
        seen.add(group)
        name = titles.get(candidate.effect, candidate.effect)
        others = listing([titles.get(rival, rival) for rival in rivals], "or")
        sentences.append(f"These sessions cannot tell {name} from {others}: each explains them equally well.")
    return sentences
