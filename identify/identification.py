"""`identify`: a model fitted to all sessions so far, its parameters with deviations, its errors."""

from collections.abc import Sequence

from identify.effects.model import model_name
from identify.estimation.essential import essential_parameters
from identify.estimation.estimators import checked_estimator, with_estimator
from identify.estimation.fitted_model import FittedModel
from identify.estimation.fitting import Progress, fit_model
from identify.estimation.identified import Identified
from identify.estimation.requested_model import (
    chosen_entries,
    fit_linear,
    open_record,
    ratio_columns,
    requested_model,
    with_payload_columns,
    with_unknown_payloads,
)
from identify.estimation.small_algebra import single_threaded
from identify.estimation.structured import fit_structured, held_out
from identify.recording import Experiment
from identify.results.document import Json
from identify.results.identification import IdentificationDocument
from identify.validation.document import identification_document

WORSE_HELD_OUT = 0.02
"""By how much of the torque the linear form (30) may predict worse than the structured one on time that neither
fit saw. Beyond, its many products fit noise: it is not identifiable on the record."""


class Identification(Identified):
    """The result of `identify`: what was identified, and its document."""

    def document(self) -> IdentificationDocument:
        """The contract's `identify --json`, section 3."""
        return identification_document(self)

    def to_json(self) -> Json:
        """The document as plain values."""
        return self.document().to_json()


@single_threaded
def identify(
    experiment: Experiment,
    model: str = "usual",
    add: Sequence[str] = (),
    progress: Progress | None = None,
    estimator: str | None = None,
    essential: bool = False,
    payloads: Sequence[str] = (),
    unknown_payloads: Sequence[str] = (),
) -> Identification:
    """Fit a model to all identification sessions at once and check it on the validation sessions.

    model     : `rigid`, `usual` (eq. 8), `load-velocity` (eq. 30), `rigid+effect,effect…`, or `link-side` where the torque
                is measured behind motor and gear
    add       : further effects, `EFFECT` or `EFFECT@JOINT`
    estimator : `ordinary`, `weighted`, `robust` or `instrumental`; weighted for several joints if not said
    essential : eliminate the parameters that the data do not show, one by one (section IV.D)
    payloads  : names of payloads; the fit uses the identification sessions with one of them only (Table IV)
    unknown_payloads : names of payloads whose ten parameters are estimated, whatever was declared of them
    Raises InputError: the experiment, the model, an effect, the estimator or a payload is wrong.
    """
    model = model_name(model)
    estimator = checked_estimator(estimator, experiment.n)
    experiment = with_unknown_payloads(experiment, unknown_payloads)
    record = open_record(experiment, model)
    entries = chosen_entries(record, payloads)
    wanted = with_payload_columns(record, requested_model(record, model, add), unknown_payloads)

    def estimated(fitted: FittedModel) -> FittedModel:
        reduced = essential_parameters(fitted, ratio_columns(fitted)) if essential else fitted
        return with_estimator(reduced, estimator).with_own_load()

    first = fit_model(record, wanted, entries, progress=progress)
    terms = first.model.terms
    if model != "load-velocity":
        return Identification(
            experiment, model, terms, estimated(first), unknown_payloads=tuple(unknown_payloads)
        )
    linear = fit_linear(record, first, add)
    structured = fit_structured(linear, first.fit.weights)
    linear_error, structured_error = held_out(linear, structured)
    if linear_error <= structured_error + WORSE_HELD_OUT:
        return Identification(experiment, model, terms, estimated(linear), structured)
    remark = (
        f"the linear form (30) is not identifiable on this record: on time that the fit did not see its relative "
        f"error is {linear_error:.3g}, the structured form's {structured_error:.3g}; the structured form replaces it"
    )
    remarks = [remark]
    if essential or estimator in ("robust", "instrumental"):
        remarks.append(
            "it is a weighted least squares estimate of all its parameters: no other estimator, no elimination"
        )
    return Identification(
        experiment, model, terms, structured.fitted, structured, "structured", tuple(remarks)
    )
