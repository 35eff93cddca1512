"""The evidence of one effect: equation, explanation, errors without and with it, and the residual over its own variable.

Before an effect is added, "with it" is what the diagnosis predicts: the model with that one effect more, fitted when the
diagnosis was made. Afterwards it is what the fit found.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from api.pages.catalogue_words import effect_titles, entry_of
from api.pages.constant_words import constant_words
from api.pages.effect_pictures import Picture, effect_pictures
from api.pages.effect_views import EffectView, effect_views
from api.pages.error_figures import JointUnits
from api.pages.joint_samples import JointSamples, every_few
from api.pages.kept_numbers import KeptNumbers
from api.pages.stored_models import ShownModel, StoredExperiment
from api.service.model_documents import Fit, ModelVersion
from identify.results.diagnosis import Candidate, Estimate, JointDiagnosis, Learned

_pictures: KeptNumbers[list[Picture]] = KeptNumbers("effect", list[Picture])


@dataclass(frozen=True)
class Errors:
    """Errors of a joint without and with an effect, parts of the measured torque; None where not known."""

    relative_error_before: float | None = None
    relative_error_after: float | None = None
    heldout_error_before: float | None = None
    heldout_error_after: float | None = None
    p_value: float | None = None

    @classmethod
    def of(cls, candidate: Candidate | Learned | None) -> "Errors":
        """Those that a diagnosis found."""
        if candidate is None:
            return cls()
        if isinstance(candidate, Learned):  # its errors are of motion that the fit did not see
            before, after = candidate.relative_error_before, candidate.relative_error_after
            return cls(heldout_error_before=before, heldout_error_after=after, p_value=candidate.p_value)
        return cls(
            candidate.relative_error_before,
            candidate.relative_error_after,
            candidate.heldout_error_before,
            candidate.heldout_error_after,
            candidate.p_value,
        )

    @property
    def change(self) -> float | None:
        """Of the error of the fit, as a part of it."""
        return _change(self.relative_error_before, self.relative_error_after)

    @property
    def heldout_change(self) -> float | None:
        """Of the error on motion that the fit did not see, as a part of it."""
        return _change(self.heldout_error_before, self.heldout_error_after)


@dataclass(frozen=True)
class SelectedEvidence:
    """What the page shows of one effect; `with_words` is None where nothing is predicted with it.

    other_data : says that the diagnosis behind it is of other data than the fit; None where it is of the same
    """

    effect: str
    title: str
    group: str
    equation: str
    source: str
    explanation: str
    constants: list[tuple[str, str]]
    caution: str | None
    views: list[EffectView]
    with_words: str | None
    errors: Errors
    probability: float | None
    estimates: tuple[Estimate, ...]
    other_data: str | None


def joint_diagnosis(stored: StoredExperiment, shown: ShownModel, joint: str) -> JointDiagnosis | None:
    """What the diagnosis of a version says of one joint, or None if nobody asked yet."""
    document = stored.models.diagnosis(shown.version.id)
    return None if document is None else document.joint(joint)


def selected_evidence(
    stored: StoredExperiment,
    shown: ShownModel,
    diagnosis: JointDiagnosis | None,
    joint: str,
    effect: str | None,
) -> SelectedEvidence | None:
    """The evidence of the chosen candidate, else of the first; after the last step that of the effect added last. An effect that
    was added before has the evidence of that step; one of the first model has none.

    None where there is no effect to show.
    """
    candidates = {each.effect: each for each in diagnosis.candidates} if diagnosis else {}
    of_joint = stored.declared.robot.joints[stored.joint_names.index(joint)]
    units, motor_ratio = JointUnits.of(of_joint.type), abs(of_joint.motor_ratio)
    added = (shown.version.change or "").split("@")[0] if shown.version.cause == "effect added" else None
    if effect not in (None, added, *candidates) and effect in _effects_of(shown, joint):
        step = _added_by(stored, shown, effect, joint)
        if step is not None:
            return selected_evidence(stored, step, joint_diagnosis(stored, step, joint), joint, effect)
        effect = None
    if effect is None:
        missing = diagnosis.missing if diagnosis else ()
        effect = missing[0] if missing else added or next(iter(candidates), None)
    if effect is None:
        return None
    files = stored.fitted_files(shown)
    candidate = candidates.get(effect)
    learned: Learned | None = None
    other_data: str | None = None
    in_model = False
    if effect == added and candidate is None and shown.version.parent:
        parent = stored.model(shown.version.parent)
        # A session that only one of the two was fitted to would make the pictures differ by more than the effect.
        known = stored.fitted_files(parent)
        both = [file for file in files if file in known]
        compared = _fitted(stored, parent, both or known, shown, both or files, joint)
        label: str | None = "with it"
        in_model = True
        # What was known of it when it was added, with the fit's own errors.
        diagnosed = stored.models.newest_diagnosis(parent.version.id)
        earlier = None if diagnosed is None else diagnosed[1].joint(joint)
        candidate = None if earlier is None else earlier.candidate(effect)
        if diagnosed is not None and diagnosed[0].data != shown.version.fit.data:
            other_data = _other_data(diagnosed[0], shown.version.fit)
        if earlier is not None and earlier.learned is not None and earlier.learned.effect == effect:
            learned = earlier.learned
        errors = replace(
            Errors.of(candidate or learned),
            # Errors of other data say nothing of the effect.
            relative_error_before=parent.joint(joint).relative_error
            if parent.version.fit.data == shown.version.fit.data
            else None,
            relative_error_after=shown.joint(joint).relative_error,
        )
    else:
        parts = _predicted(stored, shown, joint, files, candidate)
        compared = _predicted_beside(stored, shown, joint, files, candidate, parts)
        label = "predicted with it" if parts is not None else None
        # The model's own error is said as everywhere else; a diagnosis that estimates with instruments has another.
        errors = replace(Errors.of(candidate), relative_error_before=shown.joint(joint).relative_error)
    constants = candidate.constants if candidate else {}
    estimates = _known_estimates(candidate)
    if in_model:  # what the fit found, not what the diagnosis predicted
        constants = _fitted_constants(shown, joint, effect) or constants
        estimates = _fitted_estimates(shown, joint, estimates)
    variable = candidate.variable if candidate else learned.variables[0] if learned else None
    pictures = _pictures.of(
        shown.folder,
        [joint, units.load, effect, variable, dict(constants), *compared.of],
        lambda: effect_pictures(effect, *compared.samples(), units, variable, constants),
    )
    entry = entry_of(effect)
    known = candidate or entry
    return SelectedEvidence(
        effect=effect,
        title=effect_titles().get(effect, effect),
        group=entry.group if entry else "",
        equation=known.equation if known else (learned and learned.form) or "",
        source=entry.source if entry else "",
        explanation=known.explanation if known else learned.explanation if learned else "",
        constants=constant_words(constants, units, motor_ratio),
        caution=candidate.caution if candidate else None,
        views=effect_views(pictures, units),
        with_words=label,
        errors=errors,
        probability=candidate.probability if candidate else None,
        estimates=estimates,
        other_data=other_data if candidate is not None or learned is not None else None,
    )


def _effects_of(shown: ShownModel, joint: str) -> set[str]:
    """Names of the effects that the model has on a joint."""
    return {each.effect for each in shown.document.effects if each.joint == joint}


def _added_by(stored: StoredExperiment, shown: ShownModel, effect: str, joint: str) -> ShownModel | None:
    """The version on the way to a model that added an effect to a joint; None where the first model had it."""
    version: ModelVersion | None = shown.version
    while version is not None:
        name, _, on = (version.change or "").partition("@")
        if version.cause == "effect added" and name == effect and on in ("", joint):
            return stored.model(version.id)
        version = stored.story.version(version.parent) if version.parent else None
    return None


def _other_data(then: Fit, now: Fit) -> str:
    """That what a diagnosis found is not of the data of the fit beside it."""
    counts = f" ({then.sessions} sessions then, {now.sessions} now)" if then.sessions != now.sessions else ""
    return (
        f"The data have changed since the effect was found{counts}: the error on unseen motion and the"
        " probabilities are of the data before, and cannot be compared with the error of the fit."
    )


def _known_estimates(candidate: Candidate | None) -> tuple[Estimate, ...]:
    """Sizes that were estimated beside the model; none where the diagnosis did not."""
    given = candidate.estimates if candidate is not None and candidate.estimates is not None else ()
    return tuple(each for each in given if each.value is not None)


def _fitted_constants(shown: ShownModel, joint: str, effect: str) -> Mapping[str, float]:
    """The nonlinear constants of an effect that the fit chose; empty where it has none."""
    chosen = (
        each.values for each in shown.document.constants if (each.effect, each.joint) == (effect, joint)
    )
    return next(chosen, {})


def _fitted_estimates(shown: ShownModel, joint: str, predicted: tuple[Estimate, ...]) -> tuple[Estimate, ...]:
    """The same sizes as the fit found them; as the diagnosis did where the fit has no parameter of that name."""
    fitted = {each.name: each for each in shown.document.parameters if each.joint == joint}
    return tuple(
        each.changed(value=fitted[each.name].value, std_robust=fitted[each.name].std_robust)
        if each.name in fitted
        else each
        for each in predicted
    )


def added_evidence(stored: StoredExperiment, shown: ShownModel, joint: str) -> list[SelectedEvidence]:
    """The evidence of each effect that was added to this joint on the way to the model, as it was found then."""
    evidence = []
    version: ModelVersion | None = shown.version
    while version is not None:
        effect, _, on = (version.change or "").partition("@")
        if version.cause == "effect added" and on in ("", joint):
            step = stored.model(version.id)
            selected = selected_evidence(stored, step, joint_diagnosis(stored, step, joint), joint, effect)
            evidence += [selected] if selected is not None and selected.with_words == "with it" else []
        version = stored.story.version(version.parent) if version.parent else None
    return evidence[::-1]


@dataclass(frozen=True)
class _Compared:
    """Samples without an effect and, where they are at hand, with it; `of` says which those are."""

    of: list[object]
    samples: Callable[[], tuple[JointSamples, JointSamples | None]]


def _fitted(
    stored: StoredExperiment,
    parent: ShownModel,
    files_before: list[str],
    shown: ShownModel,
    files: list[str],
    joint: str,
) -> _Compared:
    """Of two fits."""
    before, after = parent.folder, shown.folder
    return _Compared(
        [f"{before.parent.name}/{before.name}", files_before, f"{after.parent.name}/{after.name}", files],
        lambda: (
            stored.figure_samples(parent, joint, files_before),
            stored.figure_samples(shown, joint, files),
        ),
    )


def _predicted_beside(
    stored: StoredExperiment,
    shown: ShownModel,
    joint: str,
    files: list[str],
    candidate: Candidate | None,
    parts: list[np.ndarray] | None,
) -> _Compared:
    """Of a fit, and of what it would predict with a candidate of its diagnosis: `parts` of the sessions."""

    def samples() -> tuple[JointSamples, JointSamples | None]:
        here = stored.figure_samples(shown, joint, files)
        if parts is None:
            return here, None
        rows = every_few([len(part) for part in parts])
        predicted = np.concatenate([part[of_part] for part, of_part in zip(parts, rows, strict=True)])
        return here, replace(here, predicted=predicted.astype(float))

    if parts is None or candidate is None:
        return _Compared([files], samples)
    return _Compared([files, candidate.rank, stored.models.diagnosed(shown.version.id)], samples)


def _predicted(
    stored: StoredExperiment, shown: ShownModel, joint: str, files: list[str], candidate: Candidate | None
) -> list[np.ndarray] | None:
    """The torque of each session as the model with that candidate would predict it; None where the diagnosis did not keep
    it."""
    parts = None if candidate is None else stored.candidate(shown, joint, files, candidate.rank)
    if parts is None:
        return None
    here = stored.stored_samples(shown, joint, files)
    same = all(len(part) == here[file].count for file, part in zip(files, parts, strict=True))
    return parts if same else None


def _change(before: float | None, after: float | None) -> float | None:
    return (after - before) / before if before and after is not None else None
