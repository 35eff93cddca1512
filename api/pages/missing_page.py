"""What is missing: the verdict, the ranked effects with their evidence, and the error falling from version to version."""

from collections.abc import Mapping
from typing import Annotated, Any
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse
from markupsafe import Markup

from api.pages.catalogue_words import effect_titles, entry_of
from api.pages.error_figures import JointUnits, effect_picture
from api.pages.figures.group_bars import draw_shares
from api.pages.figures.step_chart import ModelStep, draw_step_chart
from api.pages.job_views import job_state
from api.pages.layout import experiment_link, frame
from api.pages.model_page import FIGURE_SAMPLES, JointChoice, experiment_context
from api.pages.number_format import listing
from api.pages.rendering import PREFIX, page
from api.pages.stored_models import ShownModel, StoredExperiment
from api.pages.verdict_words import rival_words, verdict_of, where_words
from api.service import access

router = APIRouter(prefix=PREFIX, include_in_schema=False)

SHOWN_CANDIDATES = 6
"""Candidates that stand in the list by themselves; the rest are folded away."""
SHOWN_PLACES = 6
"""Ranges of a variable that are shown where the error sits."""

EffectChoice = Annotated[str | None, Query(max_length=100)]


@router.get("/experiments/{experiment}/missing")
def missing_page(
    request: Request,
    user: access.Viewer,
    experiment: str,
    joint: JointChoice = None,
    effect: EffectChoice = None,
) -> HTMLResponse:
    """The page."""
    stored = StoredExperiment(access.service_of(request).experiments, experiment)
    context = frame(request, user, "missing", experiment)
    joint = stored.joint_or_first(joint)
    shown = stored.current()
    context |= experiment_context(stored, joint, shown, "missing")
    if shown is None:
        return page(request, "no_model.html", **context)
    context |= body_context(stored, shown, joint, effect)
    context |= job_state(access.service_of(request).jobs, experiment, joint) | {"own_news": True}
    return page(request, "missing.html", **context)


@router.get("/experiments/{experiment}/missing/evidence")
def evidence(
    request: Request,
    _user: access.Viewer,
    experiment: str,
    joint: JointChoice = None,
    effect: EffectChoice = None,
) -> HTMLResponse:
    """The fragment that shows one effect."""
    stored = StoredExperiment(access.service_of(request).experiments, experiment)
    joint = stored.joint_or_first(joint)
    shown = stored.current()
    if shown is None:
        return page(request, "evidence.html", selected={"effect": None})
    diagnosis = joint_diagnosis(stored, shown, joint)
    return page(request, "evidence.html", selected=_selected(stored, shown, diagnosis, joint, effect))


def body_context(
    stored: StoredExperiment, shown: ShownModel, joint: str, effect: str | None = None
) -> dict[str, Any]:
    """Context of the part of the page that a step of the model exchanges."""
    diagnosis = joint_diagnosis(stored, shown, joint)
    units = JointUnits.of(stored.declared.robot.joints[stored.joint_names.index(joint)].type)
    floor = shown.joint(joint)["noise_floor"]
    titles = effect_titles()
    candidates = _candidates(stored, diagnosis, joint, floor)
    where = sorted(diagnosis["where"], key=_excess, reverse=True) if diagnosis else []
    line = [stored.model(identifier) for identifier in stored.story.line]
    before = line[-2] if len(line) > 1 else None
    return {
        "verdict": verdict_of(diagnosis, floor, titles),
        "diagnosed": diagnosis is not None,
        "model_effects": _model_effects(stored, shown, joint),
        "step_chart": step_chart(stored, joint, floor),
        "current": shown.joint(joint),
        "previous_error": before.joint(joint)["relative_error"] if before else None,
        "noise_floor": floor,
        "candidates": [each for each in candidates if each["shown"]],
        "further": [each for each in candidates if not each["shown"]],
        "superfluous": [titles.get(name, name) for name in (diagnosis or {}).get("superfluous", [])],
        "no_candidates": "No effect of the catalogue would help."
        if diagnosis
        else "Nobody has asked yet what this model misses.",
        "selected": _selected(stored, shown, diagnosis, joint, effect),
        "where_figure": draw_shares(
            [
                (where_words(place, units), place["share_of_error"] or 0.0, place.get("share_of_samples"))
                for place in where[:SHOWN_PLACES]
            ]
        )
        if where
        else None,
        "rivals": rival_words(diagnosis["candidates"], titles, diagnosis["missing"]) if diagnosis else [],
        "next_experiment": _next_words(diagnosis),
        "not_tried": _not_tried(stored, shown, joint),
        "can_undo": len(stored.story.line) > 1,
        "can_redo": bool(stored.story.undone),
        "undo_link": _step_link(stored, "undo", joint),
        "redo_link": _step_link(stored, "redo", joint),
        "diagnose_link": _step_link(stored, "diagnose", joint),
    }


def _excess(place: Mapping[str, Any]) -> float:
    """How much more of the error than of the samples a range holds."""
    return (place["share_of_error"] or 0.0) - (place.get("share_of_samples") or 0.0)


def joint_diagnosis(stored: StoredExperiment, shown: ShownModel, joint: str) -> dict[str, Any] | None:
    """What the diagnosis of a version says of one joint, or None if nobody asked yet."""
    document = stored.models.diagnosis(shown.version.id)
    if document is None:
        return None
    return next((entry for entry in document["joints"] if entry["joint"] == joint), None)


def _step_link(stored: StoredExperiment, step: str, joint: str, **further: str) -> str:
    return f"{experiment_link(stored.id, 'steps')}/{step}?{urlencode({'joint': joint, **further})}"


def _candidates(
    stored: StoredExperiment, diagnosis: Mapping[str, Any] | None, joint: str, floor: float | None
) -> list[dict[str, Any]]:
    if diagnosis is None:
        return []
    rows, titles = [], effect_titles()
    for candidate in sorted(diagnosis["candidates"], key=lambda each: each["rank"]):
        query = urlencode({"joint": joint, "effect": candidate["effect"]})
        rows.append(
            candidate
            | {
                "title": titles.get(candidate["effect"], ""),
                "gain": _gain(candidate, floor),
                "shown": len(rows) < SHOWN_CANDIDATES,
                "first": candidate["effect"] == next(iter(diagnosis["missing"]), None),
                "link": f"{experiment_link(stored.id, 'missing')}?{query}",
                "fragment_link": f"{experiment_link(stored.id, 'missing/evidence')}?{query}",
                "add_link": _step_link(stored, "add", joint, effect=candidate["effect"]),
            }
        )
    return rows


def _gain(candidate: Mapping[str, Any], floor: float | None) -> float:
    """Share of the squared unseen error above the floor that the effect takes away, 0 to 1."""
    before, after = candidate["heldout_error_before"], candidate["heldout_error_after"]
    if not before or after is None:
        return 0.0
    rest = before**2 - (floor or 0.0) ** 2
    return min(max((before**2 - after**2) / rest, 0.0), 1.0) if rest > 0 else 0.0


def _model_effects(stored: StoredExperiment, shown: ShownModel, joint: str) -> list[dict[str, Any]]:
    """The effects of the joint in the model; those that were added to the start can be removed."""
    added = {text: text.split("@")[0] for text in shown.version.add if text.split("@")[-1] in (joint, text)}
    rows = []
    for entry in shown.document["effects"]:
        if entry["joint"] not in (joint, None):
            continue
        text = next((full for full, name in added.items() if name == entry["effect"]), None)
        rows.append(
            {
                "effect": entry["effect"],
                "added": text is not None,
                "removable": text is not None,
                "remove_link": _step_link(stored, "remove", joint, effect=text or ""),
            }
        )
    return rows


def step_chart(stored: StoredExperiment, joint: str, floor: float | None) -> Markup:
    """The staircase of one joint: the versions that stand, then those that were undone."""
    steps = []
    for identifier in [*stored.story.line, *reversed(stored.story.undone)]:
        model = stored.model(identifier)
        part = model.joint(joint)
        steps.append(
            ModelStep(
                label=model.words.replace(f"@{joint}", ""),
                relative_error=part["relative_error"],
                relative_error_validation=part["relative_error_validation"],
                undone=identifier in stored.story.undone,
                current=identifier == stored.story.line[-1],
            )
        )
    return draw_step_chart(steps, floor)


def _selected(
    stored: StoredExperiment,
    shown: ShownModel,
    diagnosis: Mapping[str, Any] | None,
    joint: str,
    effect: str | None,
) -> dict[str, Any]:
    """The evidence of the chosen candidate, else of the first; after the last step that of the effect added last."""
    candidates = {each["effect"]: each for each in (diagnosis or {"candidates": []})["candidates"]}
    units = JointUnits.of(stored.declared.robot.joints[stored.joint_names.index(joint)].type)
    added = (shown.version.change or "").split("@")[0] if shown.version.cause == "effect added" else None
    if effect is None:
        missing = diagnosis["missing"] if diagnosis else []
        effect = missing[0] if missing else added or next(iter(candidates), None)
    if effect is None:
        return {"effect": None}
    files = stored.fitted_files(shown)
    here = stored.samples(shown, joint, files).thinned(FIGURE_SAMPLES).in_fit
    if effect == added and effect not in candidates and shown.version.parent:
        parent = stored.model(shown.version.parent)
        before = stored.samples(parent, joint, stored.fitted_files(parent)).thinned(FIGURE_SAMPLES).in_fit
        picture, own = effect_picture(effect, before, here, units)
        evidence = _step_evidence(stored, parent, shown, joint, effect)
    else:
        evidence = candidates.get(effect) or {}
        picture, own = effect_picture(effect, here, None, units, evidence.get("variable"))
    entry = entry_of(effect)
    errors = {
        key: evidence.get(key)
        for key in (
            "relative_error_before",
            "relative_error_after",
            "heldout_error_before",
            "heldout_error_after",
            "p_value",
        )
    }
    return {
        "effect": effect,
        "title": effect_titles().get(effect, effect),
        "group": entry.get("group", ""),
        "equation": entry.get("equation", ""),
        "source": entry.get("source", ""),
        "explanation": evidence.get("explanation") or entry.get("explanation", ""),
        "picture": picture,
        "picture_words": f"Residual over {own.words}",
        "with_fit": effect == added and effect not in candidates,
        "change": _change(errors["relative_error_before"], errors["relative_error_after"]),
        "heldout_change": _change(errors["heldout_error_before"], errors["heldout_error_after"]),
        **errors,
    }


def _step_evidence(
    stored: StoredExperiment, parent: ShownModel, shown: ShownModel, joint: str, effect: str
) -> dict[str, Any]:
    """What was known of an effect when it was added: the diagnosis of the version before, with the fit's own errors."""
    earlier = joint_diagnosis(stored, parent, joint)
    known = next((each for each in earlier["candidates"] if each["effect"] == effect), {}) if earlier else {}
    return dict(known) | {
        "relative_error_before": parent.joint(joint)["relative_error"],
        "relative_error_after": shown.joint(joint)["relative_error"],
    }


def _change(before: float | None, after: float | None) -> float | None:
    return (after - before) / before if before and after is not None else None


def _next_words(diagnosis: Mapping[str, Any] | None) -> str | None:
    """The experiment that would separate what cannot be told apart: the one that the diagnosis plans, else what the
    rivals need to be seen."""
    if diagnosis is None:
        return None
    proposal = diagnosis.get("next_experiment")
    if proposal:
        return proposal["words"] if isinstance(proposal, Mapping) else str(proposal)
    needs: dict[str, None] = {}
    for candidate in diagnosis["candidates"]:
        if candidate["effect"] in diagnosis["missing"]:
            for effect in [candidate["effect"], *candidate["indistinguishable_from"]]:
                if candidate["indistinguishable_from"]:
                    needs |= dict.fromkeys(entry_of(effect).get("needs") or [])
    return f"A session with {listing(needs)}, measured once more and longer." if needs else None


def _not_tried(stored: StoredExperiment, shown: ShownModel, joint: str) -> list[dict[str, str]]:
    """Effects that these data cannot show at all, each with its reason."""
    document = stored.models.diagnosis(shown.version.id) or {}
    rows = [entry for entry in document.get("not_applicable", []) if entry.get("joint") in (joint, None)]
    return [{"effect": entry["effect"], "reason": entry["reason"]} for entry in rows]
