"""What the address of a page may ask for (a rig, joint, session, version, effect), and what it then shows."""

from typing import Annotated

from fastapi import Query, Request

from api.pages.stored_models import ShownModel, StoredExperiment
from api.service import access
from api.service.problems import Problem

RigChoice = Annotated[str | None, Query(max_length=64)]


LAST_RIG = "rig"
"""Key of the browser's session under which the rig that was looked at last is kept."""


JointChoice = Annotated[str | None, Query(max_length=64)]


SessionChoice = Annotated[str, Query(max_length=255)]


VersionChoice = Annotated[str | None, Query(max_length=12)]


ALL_SESSIONS = "all"


EffectChoice = Annotated[str | None, Query(max_length=100)]


def chosen_rig(request: Request, rig: str | None) -> str:
    """The rig asked for, else the one looked at last, else the first. Raises the problem 404 for an unknown one."""
    files = access.service_of(request).rigs.files()
    wanted = rig or request.session.get(LAST_RIG)
    if wanted not in files:
        if rig:
            raise Problem(404, f"There is no rig {rig}; there are {', '.join(files)}.")
        wanted = next(iter(files), None)
        if wanted is None:
            raise Problem(404, "There is no rig yet: put its file into the folder rigs of the data folder.")
    request.session[LAST_RIG] = wanted
    return wanted


def chosen_model(stored: StoredExperiment, number: str | None) -> ShownModel | None:
    """A version by its id (`m2`) or by its place (`2`); None for none. Raises the problem 404."""
    if not number:
        return None
    if number.isdecimal():
        if not 1 <= int(number) <= len(stored.story.versions):
            raise Problem(404, f"The experiment has no model {number}.")
        return stored.model(stored.story.versions[int(number) - 1].id)
    return stored.model(number)


def files_of_session(
    stored: StoredExperiment, shown: ShownModel, other: ShownModel | None, session: str
) -> list[str]:
    """Files of the sessions that were chosen and that both models were fitted with.

    Raises the problem 404 where the session is not among them.
    """
    files = stored.fitted_files(shown)
    if other is not None:
        files = [file for file in files if file in stored.fitted_files(other)]
    if session == ALL_SESSIONS:
        return files
    if session not in files:
        raise Problem(404, f"The model was not fitted with a session {session}; choose another or fit again.")
    return [session]
