"""What makes a fit doubtful before anybody reads its parameters, in words."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT
from identify.effects.admissible import named_parameters
from identify.estimation.fitted_model import FittedModel
from identify.estimation.parameters import column_names
from identify.estimation.record import Record

MUCH_WORSE = 2.0
"""Times the error of the fit on motion that it did not see. Noise and the parameters' deviations raise it by a part of
itself; twice as much says that the motion of the fit does not tell the parameters, or that something else is wrong."""
HUGE = 10.0
"""Times the measured torque that a parameter's share must be for two of them to count as cancelling each other; shares of
inertia and gravity are about as large as the torque itself."""

NEVER_NEGATIVE = (0, 3, 5, 9, 10)
"""XX, YY, ZZ, M and Ia among the standard parameters of a link"""
SMALL = 1e-9
"""of a coefficient of a regrouped parameter: rounding"""


@dataclass(frozen=True)
class Doubt:
    """What is wrong with a parameter's value.

    subject    : the parameter's name; of two that cancel each other both
    predicate  : what is said of it
    of_several : the same, said of several parameters
    figure     : value that the predicate ends with, of this parameter
    """

    subject: str
    predicate: str
    of_several: str
    figure: str = ""

    @property
    def words(self) -> str:
        """The sentence on this parameter alone."""
        return f"{self.subject} {self.predicate} {self.figure}".rstrip()


def in_words(doubts_on_parameters: Iterable[Doubt]) -> list[str]:
    """One sentence for all parameters of which the same is said, in the order in which it is said first."""
    alike: dict[str, list[Doubt]] = {}
    for doubt in dict.fromkeys(doubts_on_parameters):
        alike.setdefault(doubt.of_several, []).append(doubt)
    sentences = []
    for of_several, listed in alike.items():
        if len(listed) == 1:
            sentences.append(listed[0].words)
            continue
        names, figures = (
            ", ".join(parts) for parts in zip(*((d.subject, d.figure) for d in listed), strict=True)
        )
        sentences.append(f"{names} {of_several}{f' {figures}' if listed[0].figure else ''}")
    return sentences


def doubts(fitted: FittedModel, error: float, unseen: float | None) -> list[str]:
    """Remarks on a fit, the gravest first.

    error, unseen : relative error on the sessions of the fit and on the validation sessions
    """
    worse = predicts_worse(fitted, error, unseen)
    return [*([worse] if worse else []), *in_words(parameter_doubts(fitted).values())]


def predicts_worse(fitted: FittedModel, error: float, unseen: float | None) -> str | None:
    """Words where a model predicts unseen motion much worse than its own; else None."""
    if unseen is None or unseen <= MUCH_WORSE * error:
        return None
    return (
        f"the model predicts motion that it did not see much worse ({unseen:.3g} of the torque) than its own"
        f" ({error:.3g}); do not rely on the parameters (condition number {fitted.fit.condition_number:.3g})"
    )


def cut_commands(record: Record) -> list[str]:
    """One sentence for each motor whose recorded command stands at a limit."""
    sentences = []
    facts = [record.facts(entry) for entry in record.experiment.sessions]
    for motor, (lower, upper) in enumerate(record.command_limits.tolist()):
        count = sum(part.at((lower, upper)) for each in facts for part in each.standing[motor])
        if not count:
            continue
        values = " and ".join(f"{value:.5g}" for value in (lower, upper) if np.isfinite(value))
        sentences.append(
            f"{record.joint_names[motor]}: the recorded command was cut at {values}, where {count} samples stand."
            " What the motor gave there is not in the record, and these samples are left out"
        )
    return sentences


def parameter_doubts(fitted: FittedModel) -> dict[int, Doubt]:
    """By column what makes the value of its parameter meaningless or impossible; nothing for the others."""
    names = [name for name, *_ in column_names(fitted)]
    fit, base = fitted.fit, fitted.record.body.base
    by_column: dict[int, Doubt] = {}
    for first, second in cancels(fitted):
        said = "are many times the measured torque and cancel each other: only "
        doubt = Doubt(
            f"{names[first]} and {names[second]}",
            f"{said}their sum is known",
            f"{said}the sum of the two is known, of each pair",
        )
        by_column.setdefault(first, doubt)
        by_column.setdefault(second, doubt)
    if fit.free is not None:
        for column in np.flatnonzero(~np.isclose(fit.chi, fit.free, rtol=1e-3, atol=1e-12)):
            if fit.chi[column] == 0:
                by_column[int(column)] = Doubt(
                    names[column],
                    "is held at 0, the least that it can be: least squares alone would find",
                    "are held at 0, the least that they can be: least squares alone would find",
                    f"{fit.free[column]:.3g}",
                )
    # a sum of masses and of inertias about axes, with positive parts only, is positive on any robot
    if fitted.record.joints and np.isin(fit.fitted, np.arange(fitted.observation.base)).any():
        kinds = np.arange(base.matrix.shape[1]) % PARAMETERS_PER_JOINT
        positive = np.isin(kinds, NEVER_NEGATIVE)
        for column in fit.fitted[fit.fitted < fitted.observation.base]:
            row = base.matrix[column]
            sums_up = not np.any(np.abs(row[~positive]) > SMALL) and not np.any(row < -SMALL)
            if fit.chi[column] < 0 and sums_up:
                said = "negative, which no mass and no inertia can be"
                by_column.setdefault(int(column), Doubt(names[column], f"is {said}", f"are {said}"))
    for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True):
        summary = fitted.record.summaries[slot.term.joint]
        listed = named_parameters(slot.term, slot.values, len(columns), summary)
        for column, parameter in zip(columns.tolist(), listed, strict=True):
            if column in fit.fitted and not parameter.lower <= fit.chi[column] <= parameter.upper:
                limit = f"at least {parameter.lower:.3g}"
                if fit.chi[column] > parameter.upper:
                    limit = f"at most {parameter.upper:.3g}"
                of_several = f"are impossible: each can be {limit}"
                by_column.setdefault(
                    column, Doubt(names[column], f"is impossible: it can be {limit}", of_several)
                )
    return by_column


def cancels(fitted: FittedModel) -> list[tuple[int, int]]:
    """Pairs of columns whose shares are huge and nearly the opposite of each other."""
    fit = fitted.fit
    if fit.r.shape[1] != len(fit.fitted) or not len(fit.fitted):
        return []  # the factor of a structured fit is of its physical parameters, not of the products of eq. (30)
    torque = float(np.linalg.norm(fit.weights * fit.norm))
    shares = fit.r * fit.chi[fit.fitted]
    size = np.linalg.norm(shares, axis=0)
    huge = np.flatnonzero(size > HUGE * torque)
    pairs = []
    for place, first in enumerate(huge):
        for second in huge[place + 1 :]:
            both = float(np.linalg.norm(shares[:, first] + shares[:, second]))
            if both < 0.5 * min(size[first], size[second]):
                pairs.append((int(fit.fitted[first]), int(fit.fitted[second])))
    return pairs
