"""The evidence of one effect: equation, explanation, errors without and with it, and the residual over its own variable.

Before an effect is added, "with it" is what the diagnosis predicts: the model with that one effect more, fitted when the
diagnosis was made. Afterwards it is what the fit found.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from api.pages.catalogue_words import effect_titles, entry_of
from api.pages.error_figures import JointUnits, effect_picture
from api.pages.joint_samples import JointSamples
from api.pages.model_figures import FIGURE_SAMPLES
from api.pages.stored_models import ShownModel, StoredExperiment
from api.pages.verdict_words import constant_words

ERRORS = (
    "relative_error_before",
    "relative_error_after",
    "heldout_error_before",
    "heldout_error_after",
    "p_value",
)


def joint_diagnosis(stored: StoredExperiment, shown: ShownModel, joint: str) -> dict[str, Any] | None:
    """What the diagnosis of a version says of one joint, or None if nobody asked yet."""
    document = stored.models.diagnosis(shown.version.id)
    if document is None:
        return None
    return next((entry for entry in document["joints"] if entry["joint"] == joint), None)


def selected_evidence(
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
    here = stored.samples(shown, joint, files)
    if effect == added and effect not in candidates and shown.version.parent:
        parent = stored.model(shown.version.parent)
        before = stored.samples(parent, joint, stored.fitted_files(parent)).thinned(FIGURE_SAMPLES).in_fit
        with_it: JointSamples | None = here.thinned(FIGURE_SAMPLES).in_fit
        words = "with it"
        evidence = _step_evidence(stored, parent, shown, joint, effect)
    else:
        evidence = candidates.get(effect) or {}
        before = here.thinned(FIGURE_SAMPLES).in_fit
        with_it = _predicted(stored, shown, joint, files, here, evidence.get("rank"))
        words = "predicted with it" if with_it is not None else None
    picture, over = effect_picture(effect, before, with_it, units, evidence.get("variable"))
    entry = entry_of(effect)
    errors = {key: evidence.get(key) for key in ERRORS}
    return {
        "effect": effect,
        "title": effect_titles().get(effect, effect),
        "group": entry.get("group", ""),
        "equation": evidence.get("equation") or entry.get("equation", ""),
        "source": entry.get("source", ""),
        "explanation": evidence.get("explanation") or entry.get("explanation", ""),
        "constants": constant_words(evidence.get("constants") or {}, units),
        "caution": evidence.get("caution"),
        "picture": picture,
        "picture_words": f"Residual over {over.label}",
        "with_words": words,
        "change": _change(errors["relative_error_before"], errors["relative_error_after"]),
        "heldout_change": _change(errors["heldout_error_before"], errors["heldout_error_after"]),
        **errors,
    }


def _predicted(
    stored: StoredExperiment,
    shown: ShownModel,
    joint: str,
    files: list[str],
    here: JointSamples,
    rank: int | None,
) -> JointSamples | None:
    """The samples as the model with that candidate would predict them; None where the diagnosis did not keep them."""
    parts = None if rank is None else stored.candidate(shown, joint, files, rank)
    if parts is None or sum(len(part) for part in parts) != len(here.time):
        return None
    return replace(here, predicted=np.concatenate(parts).astype(float)).thinned(FIGURE_SAMPLES).in_fit


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
