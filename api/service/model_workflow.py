"""What a person does with an experiment's models: fit, add or remove an effect, undo, redo, compare,
diagnose, improve.

Whatever computes is a job; what it found is stored with the experiment before the job counts as done.
"""

import shutil
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from api.service.experiment_store import ExperimentStore
from api.service.job_documents import JobResult
from api.service.jobs import Arguments, Job, JobRunner, JobState
from api.service.model_documents import Cause, ModelVersion
from api.service.model_story import ModelStory, data_fingerprint
from api.service.problems import Problem
from api.service.refit import fit_entry, fresh_folder, next_refit, store_refit
from api.service.searches_aside import FIT_AGAIN, SEARCHES, set_searches_aside
from identify.effects.model import IN_EVERY_MODEL, NAMED_MODELS, model_name
from identify.recording.errors import InputError
from identify.recording.experiment_file import append_effect
from identify.results.diagnosis import DiagnosisDocument
from identify.results.effect import EffectOnJoint
from identify.results.identification import IdentificationDocument
from identify.results.next_experiment import NextExperimentDocument

if TYPE_CHECKING:  # the service does not load what its processes compute with
    from api.service.computations import FitFound, ImprovementFound

COMPUTATIONS = "api.service.computations"
NO_RIVALS = "Only weak candidates explain the data alike here; no experiment is worth running for them."


@cache
def effect_names() -> frozenset[str]:
    """Names of the catalogue's effects."""
    import identify

    return frozenset(entry.effect for entry in identify.catalogue())


@dataclass(frozen=True)
class Results:
    """What the identifier says about an experiment now.

    version        : the current model, None before the first fit
    identification : its newest fit's document
    stale          : sessions were added or settings changed since that fit
    job            : the computation under way, if any
    """

    version: ModelVersion | None
    identification: IdentificationDocument | None
    diagnosis: DiagnosisDocument | None
    stale: bool
    job: Job | None


class ModelWorkflow:
    """Models of all experiments."""

    def __init__(self, experiments: ExperimentStore, jobs: JobRunner) -> None:
        self._experiments = experiments
        self._jobs = jobs

    def story(self, experiment: str) -> ModelStory:
        """The stored story of one experiment. Raises the problem 404."""
        return ModelStory(self._experiments.folder(experiment))

    def results(self, experiment: str) -> Results:
        """What the identifier says now."""
        folder = self._experiments.folder(experiment)
        story = ModelStory(folder)
        version, job = story.read().current, self._jobs.active(experiment)
        if version is None:
            return Results(None, None, None, stale=False, job=job)
        stale = version.fit.data != data_fingerprint(folder)
        return Results(version, story.identification(version.id), story.diagnosis(version.id), stale, job)

    # --- changes of the model

    # Each is checked to its end before anything is cancelled or written. Where `set_aside` is true, searches that began by
    # themselves give way; else they are a reason to refuse.

    def fit(self, experiment: str, user: str, model: str, add: list[str]) -> Job:
        """Fit another model; it becomes the current one."""
        model = model_name(model)
        self._check_model(experiment, model, add)
        self._refuse_overlap(experiment)
        return self._submit_version(experiment, user, model, add, "fit", None)

    def add_effect(
        self, experiment: str, user: str, effect: str, joint: str | None, set_aside: bool = False
    ) -> Job:
        """Add an effect to the current model; on every joint if none is named."""
        version = self._current_version(experiment)
        change = f"{effect}@{joint}" if joint else effect
        self._check_model(experiment, version.model, [change])
        present = {(each.effect, each.joint) for each in self._effects(experiment, version)}
        joints = [joint] if joint else self._experiments.row(experiment).joints
        if all((effect, each) in present for each in joints):
            raise Problem(409, f"The model has {change} already.")
        self._refuse_overlap(experiment, set_aside)
        return self._submit_version(
            experiment, user, version.model, [*version.add, change], "effect added", change
        )

    def add_learned(self, experiment: str, user: str, joint: str, set_aside: bool = False) -> Job:
        """Add what the diagnosis of the current model offers where the catalogue ends: it is kept as an own effect of the
        experiment, and is from then on one like any other.

        Raises the problem 409: nothing is offered for the joint, or another effect of that name is kept.
        """
        story = self.story(experiment)
        version = self._current_version(experiment)
        diagnosis = story.diagnosis(version.id)
        said = None if diagnosis is None else diagnosis.joint(joint)
        if said is None or said.learned is None:
            raise Problem(409, f"The diagnosis of this model offers no description for joint {joint}.")
        folder, learned = story.folder.parent, said.learned
        change = f"{learned.effect}@{joint}"
        if change in version.add:
            raise Problem(409, f"The model has {change} already.")
        self._refuse_overlap(experiment, set_aside)
        self._jobs.refuse_more(user)
        kept = folder / f"{learned.effect}.yaml"
        declared = self._experiments.declared(experiment).effects
        if kept.name not in declared or kept.read_text(encoding="utf-8") != learned.file:
            with story.alone():
                before = data_fingerprint(folder)
                try:
                    append_effect(folder, learned.effect, learned.file)
                except InputError as error:
                    raise Problem(409, str(error)) from error
                story.same_data(before, data_fingerprint(folder))
        return self.add_effect(experiment, user, learned.effect, joint, set_aside)

    def remove_effect(
        self, experiment: str, user: str, effect: str, joint: str | None, set_aside: bool = False
    ) -> Job:
        """Remove an effect from the current model; from every joint if none is named."""
        version = self._current_version(experiment)
        change = f"{effect}@{joint}" if joint else effect
        if change in version.add:
            add = [each for each in version.add if each != change]
            self._refuse_overlap(experiment, set_aside)
            return self._submit_version(experiment, user, version.model, add, "effect removed", change)
        # The effect is part of the named model, or was added to all joints and goes from one: spell them
        # all out.
        present = [
            (each.effect, each.joint)
            for each in self._effects(experiment, version)
            if each.effect not in IN_EVERY_MODEL
        ]
        left = [pair for pair in present if pair[0] != effect or (joint is not None and pair[1] != joint)]
        if len(left) == len(present):
            raise Problem(409, f"The model has no {change}.")
        add = [f"{name}@{on}" for name, on in left]
        self._refuse_overlap(experiment, set_aside)
        return self._submit_version(experiment, user, "rigid", add, "effect removed", change)

    def undo(self, experiment: str, user: str, set_aside: bool = False) -> tuple[ModelVersion, Job | None]:
        """Go back to the version before; it is fitted anew if sessions were added since."""
        story = self.story(experiment)
        story.identification(story.read().to_undo_to())
        self._refuse_overlap(experiment, set_aside)
        version = story.undo()
        return version, self._refit_if_stale(experiment, user, version)

    def redo(self, experiment: str, user: str, set_aside: bool = False) -> tuple[ModelVersion, Job | None]:
        """Take back the last undo."""
        story = self.story(experiment)
        story.identification(story.read().to_redo())
        self._refuse_overlap(experiment, set_aside)
        version = story.redo()
        return version, self._refit_if_stale(experiment, user, version)

    def refit(self, experiment: str, user: str) -> Job:
        """Fit the current model (at first the usual one) over all sessions so far; what happens by itself
        after every session. Waits for its turn if something is computed; the earlier versions follow."""
        self._experiments.folder(experiment)
        self._jobs.cancel_kinds(experiment, SEARCHES)  # of data that are no longer all there are

        def arguments() -> Arguments:
            refit = next_refit(self.story(experiment))
            return self._fit_arguments(experiment, refit.version, refit.fit, refit.model, refit.add)

        def store(fitted: "FitFound") -> JobResult:
            version = store_refit(self.story(experiment), fitted, user)
            self._fit_earlier_again(experiment, user)
            return JobResult(model=version.id)

        return self._jobs.submit(
            "identify",
            f"{COMPUTATIONS}:fit",
            arguments,
            store,
            user=user,
            experiment=experiment,
            repeated=True,
        )

    def fit_earlier_again(self, experiment: str, user: str) -> Job | None:
        """Fit the versions again whose error is of other data than the current one's; None where all are of the same.

        One job for each, the newest version first; each begins the next.
        """
        self._refuse_overlap(experiment)
        return self._fit_earlier_again(experiment, user)

    # --- what is missing

    def diagnose(
        self, experiment: str, user: str, identifier: str | None = None, motion: bool = False
    ) -> Job:
        """Find what a version (the current one if none is named) misses.

        motion : whether motion is predicted too, where the fit did not see
        """
        story = self.story(experiment)
        version = story.read().required(identifier)
        self._refuse_overlap(experiment)

        def store(document: DiagnosisDocument) -> JobResult:
            story.store_diagnosis(version.id, document)
            self._fit_earlier_again(experiment, user)
            return JobResult(model=version.id, diagnosis=version.id)

        def arguments() -> Arguments:
            return {
                "experiment": str(story.folder.parent),
                "model": version.model,
                "add": version.add,
                "output": str(story.fit_folder(version.id)),
                "motion": motion,
            }

        return self._jobs.submit(
            "diagnose", f"{COMPUTATIONS}:diagnose", arguments, store, user=user, experiment=experiment
        )

    def separate(self, experiment: str, user: str, joint: str, identifier: str | None = None) -> Job:
        """Plan the experiment that tells apart what the diagnosis of a version left open on one joint.

        Raises the problem 404 (no such joint), 409 (not diagnosed yet, or nothing is left open).
        """
        joints = self._experiments.row(experiment).joints
        if joint not in joints:
            raise Problem(404, f"The robot has no joint {joint}; it has {', '.join(joints)}.")
        story = self.story(experiment)
        version = story.read().required(identifier)
        diagnosis = story.diagnosis(version.id)
        if diagnosis is None:
            raise Problem(409, f"The model {version.id} was not diagnosed yet: ask first what it misses.")
        said = diagnosis.joint(joint)
        if said is None or not any(each.indistinguishable_from for each in said.candidates):
            raise Problem(409, f"On joint {joint} nothing is left that these sessions cannot tell apart.")
        self._refuse_overlap(experiment)

        def arguments() -> Arguments:
            return {
                "experiment": str(story.folder.parent),
                "model": version.model,
                "add": version.add,
                "joint": joint,
                "diagnosis": diagnosis,
            }

        def store(document: NextExperimentDocument | None) -> JobResult:
            nothing = NextExperimentDocument(
                experiment=self._experiments.declared(experiment).name,
                joint=joint,
                rivals=(),
                separation_so_far=None,
                proposals=(),
                posture=(),
                advice=NO_RIVALS,
            )
            story.store_next_experiment(version.id, joints.index(joint), document or nothing)
            self._fit_earlier_again(experiment, user)
            return JobResult(model=version.id, joint=joint)

        return self._jobs.submit(
            "separate", f"{COMPUTATIONS}:separate", arguments, store, user=user, experiment=experiment
        )

    def improve(self, experiment: str, user: str, motion: bool = False) -> Job:
        """Diagnose and add, step by step, until nothing more is justified; every step becomes a version.

        motion : whether motion is predicted too, where the fit did not see
        """
        start = self._current_version(experiment)
        self._refuse_overlap(experiment)
        story = self.story(experiment)

        def arguments() -> Arguments:
            first = int(story.next_version_id()[1:])
            for old in story.folder.glob("m*"):
                if int(old.name[1:]) >= first:
                    shutil.rmtree(old)  # left over from a computation that was cancelled
            return {
                "experiment": str(story.folder.parent),
                "model": start.model,
                "add": start.add,
                "models": str(story.folder),
                "first": first,
                "motion": motion,
            }

        def store(improved: "ImprovementFound") -> JobResult:
            for step in improved.versions:
                story.add_version(
                    model=start.model,
                    add=step.add,
                    cause="improved",
                    change=step.change,
                    user=user,
                    fit=fit_entry("f1", step.fit),
                )
            current = story.read().line[-1]
            self._fit_earlier_again(experiment, user)
            return JobResult(model=current, improvement=improved.improvement)

        return self._jobs.submit(
            "improve", f"{COMPUTATIONS}:improve", arguments, store, user=user, experiment=experiment
        )

    # --- inside

    def _current_version(self, experiment: str) -> ModelVersion:
        return self.story(experiment).read().required()

    def _effects(self, experiment: str, version: ModelVersion) -> tuple[EffectOnJoint, ...]:
        """Effects of a fitted version, those of its named model included."""
        return self.story(experiment).identification(version.id).effects

    def _refuse_overlap(self, experiment: str, set_aside: bool = False) -> None:
        """Raises the problem 409 while another computation of the experiment is under way; earlier versions that are fitted
        again give way, and with `set_aside` all searches do."""
        self._experiments.folder(experiment)
        gives_way = SEARCHES if set_aside else (FIT_AGAIN,)
        others = [each for each in self._jobs.unfinished(experiment) if each.kind not in gives_way]
        if others:
            job = others[0]
            raise Problem(
                409, f"The job {job.kind} of this experiment is not done yet; wait or cancel it.", job=job.id
            )
        if set_aside:
            set_searches_aside(self._jobs, experiment)
        else:
            self._jobs.cancel_kinds(experiment, gives_way)  # begun again once what is asked for is done

    def _check_model(self, experiment: str, model: str, add: list[str]) -> None:
        declared = self._experiments.declared(experiment)
        joints = [joint.name for joint in declared.robot.joints]
        names = list(add)
        if model not in NAMED_MODELS:
            if not model.startswith("rigid+"):
                raise Problem(
                    422, f"model: `{model}` is not one of {', '.join(NAMED_MODELS)}, rigid+EFFECT,EFFECT…"
                )
            names += model.removeprefix("rigid+").split(",")
        for name in names:
            effect, _, joint = name.partition("@")
            # An experiment may bring effects of its own; the identifier knows them by name.
            if effect not in effect_names() and not declared.effects:
                raise Problem(422, f"effect: `{effect}` is not in the catalogue (GET /effects).")
            if joint and joint not in joints:
                raise Problem(422, f"joint: `{joint}` is not one of {', '.join(joints)}.")

    def _submit_version(
        self, experiment: str, user: str, model: str, add: list[str], cause: Cause, change: str | None
    ) -> Job:
        story = self.story(experiment)

        def arguments() -> Arguments:
            return self._fit_arguments(experiment, story.next_version_id(), "f1", model, add)

        def store(fitted: "FitFound") -> JobResult:
            fit, identifier = fit_entry(fitted.folder.name, fitted), fitted.folder.parent.name
            version = story.add_version(
                model=model, add=add, cause=cause, change=change, user=user, fit=fit, identifier=identifier
            )
            self._fit_earlier_again(experiment, user)
            return JobResult(model=version.id)

        return self._jobs.submit(
            "identify", f"{COMPUTATIONS}:fit", arguments, store, user=user, experiment=experiment
        )

    def _fit_earlier_again(self, experiment: str, user: str) -> Job | None:
        """The next version that is to be fitted again, as a job; also called by the job before, as it ends."""
        story = self.story(experiment)
        stale = story.read().stale(data_fingerprint(story.folder.parent))
        waiting = [job for job in self._jobs.unfinished(experiment) if job.state == JobState.QUEUED]
        if not stale or waiting:
            return None
        version = stale[0]

        def arguments() -> Arguments:
            fit = story.next_fit_id(version.id)
            return self._fit_arguments(experiment, version.id, fit, version.model, version.add)

        def store(fitted: "FitFound") -> JobResult:
            story.add_fit(version.id, fit_entry(fitted.folder.name, fitted))
            self._fit_earlier_again(experiment, user)
            return JobResult(model=version.id)

        return self._jobs.submit(
            FIT_AGAIN, f"{COMPUTATIONS}:fit", arguments, store, user=user, experiment=experiment
        )

    def _refit_if_stale(self, experiment: str, user: str, version: ModelVersion) -> Job | None:
        fresh = version.fit.data == data_fingerprint(self._experiments.folder(experiment))
        return None if fresh else self.refit(experiment, user)

    def _fit_arguments(
        self, experiment: str, version: str, fit: str, model: str, add: list[str]
    ) -> Arguments:
        folder = self._experiments.folder(experiment)
        output = fresh_folder(ModelStory(folder), version, fit)
        return {"experiment": str(folder), "model": model, "add": add, "output": str(output)}
