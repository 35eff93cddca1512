"""What a model misses, as the page shows it and every step of the model exchanges it."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from urllib.parse import urlencode

from api.pages.catalogue_words import effect_titles
from api.pages.effect_motion import effects_on_motion
from api.pages.error_figures import JointUnits
from api.pages.evidence_view import joint_diagnosis, selected_evidence
from api.pages.layout import experiment_link
from api.pages.learned_view import learned_view
from api.pages.model_steps import step_chart, step_link
from api.pages.rendering import Context
from api.pages.rival_effects import rival_effects_context
from api.pages.scope_words import UNSEEN, scope_of_fit
from api.pages.stored_models import ShownModel, StoredExperiment
from api.pages.verdict_words import structure_words, verdict_of, where_words
from identify.effects.model import IN_EVERY_MODEL
from identify.results.diagnosis import Candidate, JointDiagnosis, NotApplicable

SHOWN_CANDIDATES = 6
"""Candidates that stand in the list by themselves; the rest are folded away."""


SHOWN_PLACES = 6
"""Ranges of a variable that are shown where the error sits."""


@dataclass(frozen=True)
class CandidateRow:
    """A candidate in the list. `gain`: part of the error on unseen motion that it takes away, 0 to 1."""

    candidate: Candidate
    title: str
    gain: float
    first: bool
    link: str
    fragment_link: str
    add_link: str


@dataclass(frozen=True)
class MissingEffect:
    """One of several missing effects, beside the model with all the others."""

    candidate: Candidate
    title: str


@dataclass(frozen=True)
class SharePlace:
    """A range of a variable, with its share of the squared error and, where known, of the samples; 0 to 1."""

    words: str
    share: float
    samples: float | None


@dataclass(frozen=True)
class ModelEffect:
    """An effect of the model on the joint, and whether and where it can be removed."""

    effect: str
    added: bool
    superfluous: bool
    removable: bool
    remove_link: str


def body_context(
    stored: StoredExperiment, shown: ShownModel, joint: str, effect: str | None = None
) -> Context:
    """Context of the part of the page that a step of the model exchanges."""
    diagnosis = joint_diagnosis(stored, shown, joint)
    units = JointUnits.of(stored.declared.robot.joints[stored.joint_names.index(joint)].type)
    floor = shown.joint(joint).noise_floor
    titles = effect_titles()
    candidates = _candidates(stored, diagnosis, joint)
    where = sorted(diagnosis.where, key=lambda place: place.excess, reverse=True) if diagnosis else []
    superfluous = diagnosis.superfluous if diagnosis else ()
    line = [stored.model(identifier) for identifier in stored.story.line]
    before = line[-2] if len(line) > 1 else None
    before_differs = before is not None and before.version.fit.data != shown.version.fit.data
    return {
        "verdict": verdict_of(diagnosis, floor, titles),
        "diagnosed": diagnosis is not None,
        "model_effects": _model_effects(stored, shown, joint, superfluous),
        "step_chart": step_chart(stored, joint, floor),
        "current": shown.joint(joint),
        "previous_error": before.joint(joint).relative_error if before and not before_differs else None,
        "previous_differs": before_differs,
        "scope": scope_of_fit(shown),
        "unseen_scope": UNSEEN,
        "other_data": len(stored.story.stale(shown.version.fit.data)),
        "fit_earlier_link": step_link(stored, "fit-earlier", joint),
        "noise_floor": floor,
        "candidates": candidates[:SHOWN_CANDIDATES],
        "by_probability": any(row.candidate.probability is not None for row in candidates),
        "further": candidates[SHOWN_CANDIDATES:],
        "superfluous": [titles.get(name, name) for name in superfluous],
        "effects_motion": effects_on_motion(stored.models.diagnosis(shown.version.id), joint),
        "judge_motion_link": step_link(stored, "diagnose", joint, motion="true"),
        "may_judge_motion": diagnosis is not None and bool(diagnosis.missing),
        "missing_effects": _missing_effects(diagnosis, titles),
        "structure": structure_words(diagnosis),
        "no_candidates": "No effect of the catalogue would help."
        if diagnosis
        else "This model has not been diagnosed yet.",
        "offered": learned_view(stored, shown, diagnosis, joint, units),
        "selected": selected_evidence(stored, shown, diagnosis, joint, effect),
        "where": [
            SharePlace(where_words(place, units), min(place.share_of_error, 1.0), place.share_of_samples)
            for place in where[:SHOWN_PLACES]
        ],
        "apart": rival_effects_context(stored, shown, diagnosis, joint),
        "not_tried": _not_tried(stored, shown, joint),
        "can_undo": len(stored.story.line) > 1,
        "can_redo": bool(stored.story.undone),
        "undo_link": step_link(stored, "undo", joint),
        "redo_link": step_link(stored, "redo", joint),
        "diagnose_link": step_link(stored, "diagnose", joint),
    }


def _missing_effects(diagnosis: JointDiagnosis | None, titles: Mapping[str, str]) -> list[MissingEffect]:
    """What each of several missing effects is worth beside the others; empty for a single one."""
    evidence = diagnosis.evidence if diagnosis else ()
    return (
        [MissingEffect(each, titles.get(each.effect, each.effect)) for each in evidence]
        if len(evidence) > 1
        else []
    )


def _candidates(stored: StoredExperiment, diagnosis: JointDiagnosis | None, joint: str) -> list[CandidateRow]:
    if diagnosis is None:
        return []
    rows, titles = [], effect_titles()
    for candidate in sorted(diagnosis.candidates, key=lambda each: each.rank):
        query = urlencode({"joint": joint, "effect": candidate.effect})
        rows.append(
            CandidateRow(
                candidate,
                title=titles.get(candidate.effect, ""),
                gain=_gain(candidate),
                first=candidate.effect == next(iter(diagnosis.missing), None),
                link=f"{experiment_link(stored.id, 'missing')}?{query}",
                fragment_link=f"{experiment_link(stored.id, 'missing/evidence')}?{query}",
                add_link=step_link(stored, "add", joint, effect=candidate.effect),
            )
        )
    return rows


def _gain(candidate: Candidate) -> float:
    """Part of the error on unseen motion that the effect takes away, 0 to 1: the change that its evidence shows."""
    before, after = candidate.heldout_error_before, candidate.heldout_error_after
    if not before or after is None:
        return 0.0
    return min(max((before - after) / before, 0.0), 1.0)


def _model_effects(
    stored: StoredExperiment, shown: ShownModel, joint: str, superfluous: Collection[str]
) -> list[ModelEffect]:
    """The effects of the joint in the model; those that were added, and those that do not help, can be removed."""
    added = {text: text.split("@")[0] for text in shown.version.add if text.split("@")[-1] in (joint, text)}
    rows = []
    for entry in shown.document.effects:
        if entry.joint != joint:
            continue
        text = next((full for full, name in added.items() if name == entry.effect), None)
        useless = entry.effect in superfluous
        rows.append(
            ModelEffect(
                effect=entry.effect,
                added=text is not None,
                superfluous=useless,
                # What every model has is said not to help, and stays.
                removable=text is not None or (useless and entry.effect not in IN_EVERY_MODEL),
                remove_link=step_link(stored, "remove", joint, effect=text or str(entry)),
            )
        )
    return rows


def _not_tried(stored: StoredExperiment, shown: ShownModel, joint: str) -> list[NotApplicable]:
    """Effects that these data cannot show at all, each with its reason."""
    document = stored.models.diagnosis(shown.version.id)
    return [entry for entry in document.not_applicable if entry.joint == joint] if document else []
