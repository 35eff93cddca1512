"""Jobs on the pages: what is being computed, how far it is, and how a page follows it."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from urllib.parse import urlencode

from fastapi import Request
from fastapi.responses import HTMLResponse

from api.pages.layout import experiment_link
from api.pages.rendering import PREFIX, Context, page
from api.service import access
from api.service.jobs import Job, JobRunner
from api.service.model_story import Story
from api.service.problems import Problem

JOB_TITLES = {
    "identify": "Fitting the model to all sessions",
    "diagnose": "Looking for what is missing",
    "separate": "Looking for the experiment that tells them apart",
    "simulate": "Predicting motion",
    "drive-tables": "Choosing the drives' tables",
    "compensate": "Computing the torque along the plan",
    "export": "Writing the model for another program",
    "improve": "Adding effects step by step",
    "plan": "Planning the motion",
    "demo": "Measuring on the simulated arm",
    "refit": "Fitting earlier versions to all sessions",
}

BESIDE = ("separate", "refit")
"""Kinds of jobs that run beside a verdict that stands, and are shown in a place of their own."""


def job_state(jobs: JobRunner, experiment: str, joint: str, ended: Job | None = None) -> Context:
    """What "what is missing" says of jobs: the one under way, or why the one that has just ended found nothing.

    What runs beside a verdict that stands is shown in its own place: `again` are earlier versions fitted again.
    """
    unfinished = jobs.unfinished(experiment)
    running = next((job for job in unfinished if job.kind not in BESIDE), None)
    again = next((job for job in unfinished if job.kind == "refit"), None)
    return {
        "running": job_context(running, experiment, joint) if running else None,
        "again": job_context(again, experiment, joint) if again else None,
        "failed": ended.words if ended is not None and ended.state in ("failed", "lost") else None,
    }


def failed_fit(jobs: JobRunner, experiment: str) -> Job | None:
    """The newest computation of an experiment that has no fit yet, if it failed."""
    newest = next(iter(jobs.jobs(experiment=experiment, limit=1)), None)
    return newest if newest is not None and newest.state in ("failed", "lost") else None


def job_context(job: Job, experiment: str, joint: str | None) -> Context:
    """Context of the progress of a job on "what is missing"."""
    steps = experiment_link(experiment, "steps")
    query = {"joint": joint or ""}
    return polled_progress(job, f"{steps}/progress", query) | {
        "cancel_link": f"{steps}/cancel?{urlencode(query)}"
    }


def fit_key(story: Story) -> str:
    """A text that is another when the current fit is another: what a page was drawn from."""
    return f"{story.current.id}.{story.current.fit.id}" if story.current is not None else ""


def news_context(experiment: str, seen: str, job: Job | None, failed: Job | None = None) -> Context:
    """Context of the strip that follows an experiment: it asks for news of the fit `seen`, and shows a job's progress, or
    why the one that should have given the first fit found nothing."""
    return {
        "news_failed": failed.words if failed is not None else None,
        "news_link": f"{experiment_link(experiment, 'news')}?{urlencode({'seen': seen})}",
        "news_job": job_progress(job) if job is not None else None,
    }


def job_progress(job: Job) -> Context:
    """Title, fraction and words of a job."""
    return {"fraction": job.fraction, "words": job.words, "title": JOB_TITLES.get(job.kind, job.kind)}


def polled_progress(job: Job, link: str, kept: Mapping[str, str] = MappingProxyType({})) -> Context:
    """The same, where the page asks for it again (`link` with what is `kept` of the form), and where it is cancelled."""
    return job_progress(job) | {
        "poll_link": f"{link}?{urlencode({'job': job.id, **kept})}",
        "cancel_link": f"{PREFIX}/jobs/{job.id}/cancel",
    }


def follow(
    request: Request,
    identifier: str,
    link: str,
    failure: str = "Nothing was found",
    result_link: Callable[[Job], str] | None = None,
    kept: Mapping[str, str] = MappingProxyType({}),
    title: str | None = None,
) -> HTMLResponse:
    """The progress of a job in place of the button that asked for it, polled at `link` with what is `kept` of the form; when it
    is done the page of its result, or the page afresh where it has none of its own.

    title : where it says more than that of the kind of job
    """
    job = access.service_of(request).jobs.get(identifier)
    if job is None:
        raise Problem(404, "That computation is no longer known; start it again.")
    if job.state.final and job.state != "done":
        tone = "warn" if job.state == "cancelled" else "fault"
        return page(request, "problem_message.html", detail=f"{failure}: {job.words}.", tone=tone)
    shown = polled_progress(job, link, kept)
    if title is not None:
        shown["title"] = title
    response = page(request, "plan_progress.html", **shown)
    if job.state.final and result_link is not None:
        response.headers["HX-Redirect"] = result_link(job)
    elif job.state.final:
        response.headers["HX-Refresh"] = "true"
    return response
