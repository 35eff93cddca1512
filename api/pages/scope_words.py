"""What the figures of a view are of: all sessions of the fit, or one of them. Every view names it, once."""

from api.pages.number_format import listing
from api.pages.stored_models import ShownModel

UNSEEN = (
    "Unseen motion is judged joint by joint, by folds that leave out stretches of the motion in turn. Samples around a reversal"
    " count less there as its instant is less well known, so that it can be below the error of the fit, where all count alike."
)
"""what the error on motion that the fit did not see is of"""
USES = {"identification": "fit", "validation": "validation"}
"""Role of a session -> what models do with it."""


def scope_of_fit(shown: ShownModel) -> str:
    """The sessions that a model was fitted to, in words; those it was only checked on, and those excluded."""
    document = shown.document
    fitted = [each.file for each in document.sessions if each.role == "identification"]
    checked = [each.file for each in document.sessions if each.role == "validation"]
    text = (
        f"all {len(fitted)} sessions of the fit"
        if len(fitted) != 1
        else f"the only session of the fit, {fitted[0]}"
    )
    if checked:
        text += f"; validated on {listing(checked)}"
    if document.excluded:
        text += f"; {listing(each.file for each in document.excluded)} excluded"
    return text


def scope_of_session(shown: ShownModel, file: str) -> str:
    """One session, and what the model has to do with it."""
    role = next((each.role for each in shown.document.sessions if each.file == file), "left out")
    used = {"identification": "in the fit", "validation": "validation only"}
    return f"only {file}, {used.get(role, 'not in the fit')}"
