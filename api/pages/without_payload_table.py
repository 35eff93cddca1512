"""Table IV of the paper: errors with all sessions and with those without payload alone."""

from api.pages.error_tables import ErrorRow
from api.pages.stored_models import ShownModel, StoredExperiment
from api.service.without_payload import errors_without_payload


def table_rows(models: list[ShownModel], joint: str) -> list[ErrorRow]:
    """The two rows of Table IV; empty until every model shown was also identified without payload."""
    stored = [errors_without_payload(model.folder) for model in models]
    if any(each is None for each in stored):
        return []
    varied = tuple(model.joint(joint).relative_error for model in models)
    alone = tuple(each.joints.get(joint) for each in stored if each is not None)
    return [
        ErrorRow("with payload variations", models[0].document.samples, varied),
        ErrorRow("without payload", stored[0].samples if stored[0] else 0, alone),
    ]


def can_be_asked(stored: StoredExperiment) -> bool:
    """Whether there are sessions both with and without payload."""
    masses = {payload.name: payload.mass for payload in stored.declared.payloads}
    used = [masses[payload] for payload in stored.payload_of.values()]
    return 0.0 in used and any(used)
