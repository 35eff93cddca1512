"""Once a fit is stored its figures are made: pages and report then read no samples of it."""

import queue

from api.pages import figures_ahead, model_figures, stored_models
from api.pages.error_figures import JointUnits
from api.pages.figures_ahead import FiguresAhead, make_figures
from api.pages.missing_body import body_context
from api.pages.model_figures import counted_errors, figures_of
from api.pages.report import write_report
from api.pages.stored_models import StoredExperiment
from api.service.jobs import Job, JobState

JOINT = "j3"


def test_pages_and_report_of_the_current_model_read_no_samples(experiments, monkeypatch) -> None:
    monkeypatch.setattr(figures_ahead, "LONG", 1000)  # so that each session's own are made too
    stored = StoredExperiment(experiments, "experiment")
    make_figures(stored, JOINT)

    def nothing(*_: object) -> None:
        raise AssertionError("samples were read")

    monkeypatch.setattr(stored_models, "gathered", nothing)
    monkeypatch.setattr(model_figures, "error_sums", nothing)
    shown = stored.require_current()
    files = stored.fitted_files(shown)
    for choice in (files, files[1:2]):
        counted_errors(stored, [shown], JOINT, choice)
        figures_of(stored, [shown], JOINT, choice, JointUnits.of("revolute"))
    body_context(stored, shown, JOINT)
    pieces, _ = write_report(stored, shown, "ada", [], [])
    assert "".join(pieces).count("<svg") >= 12


def job(state: JobState, experiment: str | None) -> Job:
    return Job("1", "identify", experiment, "ada", state, 1.0, "", 0.0)


def test_what_a_job_has_stored_is_drawn_and_what_is_broken_ends_nothing(experiments, monkeypatch) -> None:
    drawn: queue.SimpleQueue[str] = queue.SimpleQueue()

    def make(stored: StoredExperiment, joint: str) -> None:
        drawn.put(stored.id)
        if stored.id == "broken":
            raise FileNotFoundError

    monkeypatch.setattr(figures_ahead, "make_figures", make)
    ahead = FiguresAhead(experiments)
    ahead.start()
    try:
        for state, experiment in (
            (JobState.RUNNING, "running"),
            (JobState.FAILED, "failed"),
            (JobState.DONE, None),
            (JobState.DONE, "broken"),
            (JobState.DONE, "whole"),
        ):
            ahead.job_changed(job(state, experiment))
        assert [drawn.get(timeout=60), drawn.get(timeout=60)] == ["broken", "whole"]
    finally:
        ahead.close()
    assert drawn.empty()
