"""A description as the document `Learned`: its table, its closed form, its file."""

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.finding import Finding
from identify.effects.expression import OwnEffectFile, parse, with_constants
from identify.effects.learned_forms import DIRECTIONS, ClosedForm, Description, at_points
from identify.effects.model import Term
from identify.estimation.fitted_model import FittedModel
from identify.recording.strict_yaml import strict_yaml_text
from identify.results.diagnosis import Learned

Array = NDArray[np.float64]

POINTS_OF_A_FORM = 13
"""at which a closed form is told"""


def learned_document(fitted: FittedModel, term: Term, offered: Description, finding: Finding) -> Learned:
    """What is offered.

    fitted  : the model with the description
    term    : the description in it, its constants chosen
    finding : how it fares on motion that the fit did not see
    """
    variable, form = offered.variable, offered.form
    if form is None:
        knots, values, deviations = _of_a_table(offered, finding)
    else:
        knots, values, deviations = _drawn(fitted, term, offered, form)
    directed = offered.sense != "plain"
    return Learned(
        effect=term.effect.name,
        variables=(variable.name, "direction") if directed else (variable.name,),
        form=None if form is None else _as_formula(fitted, term),
        knots=(tuple(knots.tolist()), (-1.0, 1.0)) if directed else (tuple(knots.tolist()),),
        values=tuple(values.ravel().tolist()),
        deviations=tuple(deviations.ravel().tolist()),
        unit="N m" if fitted.record.summaries[term.joint].revolute else "N",
        relative_error_before=finding.relative(finding.before.total),
        relative_error_after=finding.relative(finding.after.total),
        p_value=finding.p_value,
        explanation=term.effect.explanation,
        file=effect_file(offered.effect.settings),
    )


def effect_file(settings: OwnEffectFile) -> str:
    """An own effect as YAML."""
    fields = settings.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    return strict_yaml_text(fields)


def _of_a_table(table: Description, finding: Finding) -> tuple[Array, Array, Array]:
    """Support points, values and deviations."""
    evidence = finding.estimated
    assert evidence is not None  # it is justified
    values, deviations = at_points(table, evidence.estimates), np.abs(at_points(table, evidence.deviations))
    return np.array(table.knots), values, deviations


def _parameters(fitted: FittedModel, term: Term) -> tuple[Array, Array]:
    """Fitted parameters of a term and their robust deviations."""
    for slot, columns in zip(fitted.slots, fitted.observation.slot_columns, strict=True):
        if slot.term.key == term.key:
            return fitted.fit.chi[columns], fitted.deviations[1][columns]
    raise KeyError(term.key)


def _drawn(
    fitted: FittedModel, term: Term, offered: Description, form: ClosedForm
) -> tuple[Array, Array, Array]:
    """The form at evenly spaced points; deviations where it has one parameter only."""
    variable, constants = offered.variable, dict(term.constants or ())
    knots = np.linspace(variable.low, variable.high, POINTS_OF_A_FORM)
    signal = "dq" if variable.name == "dq" else variable.formula
    known = {signal: knots, **{name: np.asarray(value) for name, value in constants.items()}}
    columns = np.column_stack(
        [
            np.broadcast_to(parse(text.format(x=variable.formula), constants)(known), knots.shape)
            for text in form.columns
        ]
    )
    parameters, robust = _parameters(fitted, term)
    values = columns @ parameters
    spread = np.abs(columns[:, 0]) * robust[0] if len(parameters) == 1 else np.full(len(knots), np.nan)
    if DIRECTIONS[offered.sense] == DIRECTIONS["plain"]:
        return knots, values, spread
    return knots, np.column_stack([-values, values]), np.column_stack([spread, spread])


def _as_formula(fitted: FittedModel, term: Term) -> str:
    """The fitted torque as one formula."""
    constants = {name: float(f"{value:.4g}") for name, value in term.constants or ()}
    parameters, _ = _parameters(fitted, term)
    return " + ".join(
        f"{value:.4g} * {with_constants(text, constants)}"
        for value, text in zip(parameters.tolist(), term.effect.regressors, strict=True)
    )
