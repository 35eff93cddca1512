"""Parameters, effects and constants of a fit, grouped as the results page and the report list them."""

from dataclasses import dataclass

from api.pages.catalogue_words import effect_of_parameter
from api.pages.constant_words import constant_words
from api.pages.error_figures import JointUnits
from api.pages.stored_models import ShownModel, StoredExperiment
from identify.results.identification import Parameter


@dataclass(frozen=True)
class ParameterRow:
    """A parameter, and what it stands for: the standard parameters that it regroups, or its effect."""

    parameter: Parameter
    stands_for: str


@dataclass(frozen=True)
class ParameterGroup:
    """The parameters of one joint."""

    joint: str
    rows: list[ParameterRow]


@dataclass(frozen=True)
class EffectInModel:
    """An effect of the model once, with the joints that have it; `all` where several joints are all of them."""

    name: str
    joints: list[str]


def parameter_groups(stored: StoredExperiment, shown: ShownModel) -> list[ParameterGroup]:
    """Parameters by joint."""
    groups = []
    for joint in stored.joint_names:
        rows = [
            ParameterRow(parameter, parameter.grouping or effect_of_parameter(parameter.name))
            for parameter in shown.document.parameters
            if parameter.joint == joint
        ]
        if rows:
            groups.append(ParameterGroup(joint, rows))
    return groups


def effects_in_model(stored: StoredExperiment, shown: ShownModel) -> list[EffectInModel]:
    """The effects of the model, in its order."""
    joints: dict[str, list[str]] = {}
    for entry in shown.document.effects:
        joints.setdefault(entry.effect, []).append(entry.joint)
    everywhere = set(stored.joint_names)
    return [
        EffectInModel(name, ["all"] if len(on) > 1 and set(on) == everywhere else on)
        for name, on in joints.items()
    ]


def constants_in_words(stored: StoredExperiment, shown: ShownModel) -> list[tuple[str, str]]:
    """The nonlinear constants that the fit chose: (effect, joint where there are several, and what it is; its value)."""
    rows = []
    joints = {joint.name: joint for joint in stored.declared.robot.joints}
    for entry in shown.document.constants:
        joint = joints[entry.joint]
        on = f" {entry.joint}" if len(joints) > 1 else ""
        chosen = constant_words(entry.values, JointUnits.of(joint.type), abs(joint.motor_ratio))
        rows += [(f"{entry.effect}{on}: {label}", value) for label, value in chosen]
    return rows
