"""What pages need is made ready before anybody opens them: templates when the service starts, figures when a fit was stored."""

import logging
import os
import queue
import threading
from contextlib import suppress
from functools import cache

import numpy as np

from api.pages.catalogue_words import effect_titles
from api.pages.error_figures import JointUnits
from api.pages.evidence_view import added_evidence, joint_diagnosis, selected_evidence
from api.pages.learned_view import learned_view
from api.pages.model_figures import counted_errors, figures_of
from api.pages.rendering import environment
from api.pages.static_content import static_digest
from api.pages.stored_models import Experiments, StoredExperiment
from api.service.job_process import NICENESS
from api.service.jobs import Job, JobState
from identify.results.diagnosis import DiagnosisDocument
from identify.results.identification import IdentificationDocument
from identify.results.next_experiment import NextExperimentDocument
from identify.results.simulation import SimulationDocument

LONG = 50_000
"""samples of a session whose own figures nobody is to wait for; those of a shorter one take some 20 ms"""
_log = logging.getLogger(__name__)


class FiguresAhead:
    """One thread of the service, which gives way to all others.

    It works joint by joint, so that a page waits for no more than one; what a page has asked for meanwhile is not made twice.
    """

    def __init__(self, experiments: Experiments) -> None:
        self._experiments = experiments
        self._waiting: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="figures-ahead", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def close(self) -> None:
        """End with the joint that is being worked on."""
        self._closing.set()
        self._waiting.put(None)
        self._thread.join()

    def job_changed(self, job: Job) -> None:
        """A job of the service has changed: once it has stored something, its experiment's figures are made."""
        if job.state is JobState.DONE and job.experiment is not None:
            self._waiting.put(job.experiment)

    def _run(self) -> None:
        with suppress(AttributeError, OSError):  # a thread has a niceness of its own on Linux alone
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)
        load_templates()
        while (experiment := self._waiting.get()) is not None:
            try:
                stored = StoredExperiment(self._experiments, experiment)
                for joint in stored.joint_names:
                    if not self._closing.is_set():
                        make_figures(stored, joint)
            except Exception:  # whoever opens the page is told what is wrong
                _log.info("no figures ahead of %s", experiment, exc_info=True)


@cache
def load_templates() -> None:
    """Compile every template, and read what every page needs: else whoever comes first waits for it."""
    templates = environment()
    for name in templates.list_templates(extensions=["html"]):
        templates.get_template(name)
    static_digest()
    effect_titles()
    for document in (IdentificationDocument, DiagnosisDocument, NextExperimentDocument, SimulationDocument):
        document.model_rebuild()  # builds its schema, which is put off until the first is read
    np.quantile(np.zeros(2), 0.5)  # loads a part of NumPy


def make_figures(stored: StoredExperiment, joint: str) -> None:
    """Compute what the pages and the report show of the current model on one joint, as far as it is not kept yet."""
    shown = stored.current()
    if shown is None:
        return
    files = stored.fitted_files(shown)
    first = stored.model(stored.story.versions[0].id)
    # The model's page shows the current model, the report the first one beside it.
    models = [shown, first] if stored.fitted_files(first) == files else [shown]
    units = JointUnits.of(stored.declared.robot.joints[stored.joint_names.index(joint)].type)
    counted_errors(stored, models, joint, files)
    figures_of(stored, models, joint, files, units)
    diagnosis = joint_diagnosis(stored, shown, joint)
    learned_view(stored, shown, diagnosis, joint, units)
    selected_evidence(stored, shown, diagnosis, joint, None)
    added_evidence(stored, shown, joint)
    for file, part in stored.stored_samples(shown, joint, files).items():
        if len(files) > 1 and part.count > LONG:
            counted_errors(stored, [shown], joint, [file])
            figures_of(stored, [shown], joint, [file], units)
