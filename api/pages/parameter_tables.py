"""Parameters, effects and constants of a fit, grouped as the results page and the report list them."""

from typing import Any

from api.pages.catalogue_words import effect_of_parameter
from api.pages.error_figures import JointUnits
from api.pages.stored_models import ShownModel, StoredExperiment
from api.pages.verdict_words import constant_words


def parameter_groups(stored: StoredExperiment, shown: ShownModel) -> list[dict[str, Any]]:
    """Parameters by joint, those of the whole robot last."""
    groups = []
    for joint in [*stored.joint_names, None]:
        rows = [
            entry | {"stands_for": entry.get("grouping") or effect_of_parameter(entry["name"])}
            for entry in shown.document["parameters"]
            if entry["joint"] == joint
        ]
        if rows:
            groups.append({"joint": joint, "parameters": rows})
    return groups


def effects_by_name(stored: StoredExperiment, shown: ShownModel) -> dict[str, dict[str, Any]]:
    """The effects of the model once each, with the joints that have them; `all` where every joint does."""
    joints: dict[str, list[str]] = {}
    for entry in shown.document["effects"]:
        joints.setdefault(entry["effect"], []).append(entry["joint"] or "all")
    everywhere = set(stored.joint_names)
    return {
        name: {"name": name, "joints": ["all"] if len(on) > 1 and set(on) == everywhere else on}
        for name, on in joints.items()
    }


def constants_in_words(stored: StoredExperiment, shown: ShownModel) -> list[tuple[str, str]]:
    """The nonlinear constants that the fit chose: (effect, joint where there are several, and what it is; its value)."""
    rows = []
    types = {joint.name: joint.type for joint in stored.declared.robot.joints}
    for entry in shown.document.get("constants") or []:
        units = JointUnits.of(types.get(entry.get("joint"), "revolute"))
        values = {name: value for name, value in entry.items() if isinstance(value, int | float)}
        on = f" {entry['joint']}" if len(types) > 1 and entry.get("joint") else ""
        rows += [(f"{entry['effect']}{on}: {words}", value) for words, value in constant_words(values, units)]
    return rows
