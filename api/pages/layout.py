"""What every page is given: who looks at it, where the steps lead, and the token that guards its actions."""

from fastapi import Request

from api.pages.rendering import PREFIX, Context
from api.service import access
from api.service.accounts import Role, User

LAST_EXPERIMENT = "experiment"
"""Key of the browser's session under which the experiment that was looked at last is kept."""


def frame(request: Request, user: User, here: str, experiment: str | None = None) -> Context:
    """Context of the base template; `here` is the step's name, `experiment` the id that the page shows."""
    if experiment is not None:
        request.session[LAST_EXPERIMENT] = experiment
    experiment = experiment or request.session.get(LAST_EXPERIMENT)
    return {
        "here": here,
        "user": user,
        "may_change": user.role.covers(Role.OPERATOR),
        "administrator": user.role.covers(Role.ADMIN),
        "disk_warning": access.service_of(request).disk.state.warning,
        "csrf": access.masked(access.csrf_token(request)),
        "links": step_links(experiment),
    }


def step_links(experiment: str | None) -> dict[str, str]:
    """Address of each step; without an experiment its three pages lead to the list to choose one from."""
    links = {step: f"{PREFIX}/{step}" for step in ("rig", "new-session", "live")}
    for step in ("model", "missing", "results"):
        links[step] = experiment_link(experiment, step) if experiment else f"{PREFIX}/experiments"
    return links


def experiment_link(experiment: str, step: str) -> str:
    """Address of an experiment's page: `model`, `missing`, `results` or one below it."""
    return f"{PREFIX}/experiments/{experiment}/{step}"


def session_link(experiment: str, session: str) -> str:
    """Address of the page of one session of an experiment."""
    return experiment_link(experiment, f"sessions/{session}")
