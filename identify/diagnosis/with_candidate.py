"""What a model would predict with one effect more, before anybody adds it."""

from collections.abc import Iterator, Sequence

from identify.diagnosis.diagnosis import Diagnosis
from identify.diagnosis.finding import Finding
from identify.estimation.fitting import fit_model
from identify.estimation.prediction import Prediction, predict_sessions
from identify.estimation.small_algebra import single_threaded
from identify.recording import SessionEntry


def shown_findings(diagnosis: Diagnosis, joint: int, ranked: int) -> Iterator[Finding]:
    """The findings of a joint that are shown: the `ranked` best, and whatever is missing."""
    diagnosed = diagnosis.joints[joint]
    missing = {term.effect.name for term in diagnosed.missing}
    for rank, finding in enumerate(diagnosed.findings):
        if rank < ranked or finding.candidate.name in missing:
            yield finding


@single_threaded
def predictions_with(
    diagnosis: Diagnosis, finding: Finding, entries: Sequence[SessionEntry]
) -> list[Prediction]:
    """Predictions of the diagnosed model with one candidate added, of the joint that it was judged on, for each session.

    The constants are those that the search chose, so that one linear fit is all it takes.
    """
    candidate = finding.candidate
    term = candidate.term.chosen(candidate.constants[finding.variant])
    record = diagnosis.fitted.record
    better = fit_model(record, diagnosis.fitted.model.with_terms([term]))
    return [parts[candidate.judged] for parts in predict_sessions(better, entries)]
