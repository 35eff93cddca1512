"""What the pages of one experiment have in common: its name, the tabs of its joints, and what stands there before a model."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from urllib.parse import urlencode

from fastapi import Request
from fastapi.responses import HTMLResponse

from api.pages.job_views import fit_key, news_context
from api.pages.layout import experiment_link
from api.pages.rendering import Context, page
from api.pages.stored_models import ShownModel, StoredExperiment
from api.service import access


@dataclass(frozen=True)
class JointTab:
    """A joint that the page can be asked for, and the current model's error there."""

    name: str
    relative_error: float | None
    link: str


def experiment_context(
    stored: StoredExperiment,
    joint: str,
    shown: ShownModel | None,
    here: str,
    kept: Mapping[str, str] = MappingProxyType({}),
) -> Context:
    """What the pages of an experiment have in common: its name and the tabs of its joints.

    kept : what the address of another joint keeps of this page's
    """
    errors = {entry.joint: entry.relative_error for entry in shown.document.joints} if shown else {}
    joints = [
        JointTab(
            name=name,
            relative_error=errors.get(name),
            link=f"{experiment_link(stored.id, here)}?{urlencode({'joint': name, **kept})}",
        )
        for name in stored.joint_names
    ]
    seen = fit_key(stored.story)
    return {
        "experiment": stored,
        "joints": joints,
        "joint": joint,
        "own_news": False,
        "sessions_link": experiment_link(stored.id, "sessions"),
        **news_context(stored.id, seen, None),
    }


def no_model_page(request: Request, stored: StoredExperiment, joint: str, context: Context) -> HTMLResponse:
    """What stands in place of a page that needs a model: how to come to one."""
    jobs = access.service_of(request).jobs
    context = context | experiment_context(stored, joint, None, "model")
    waiting = bool(stored.identification_files)
    return page(
        request,
        "no_model.html",
        **context,
        waiting=waiting,
        fit_link=experiment_link(stored.id, "steps/fit"),
        # What failed is not begun again by itself.
        begin=waiting and not jobs.jobs(experiment=stored.id, limit=1),
    )
