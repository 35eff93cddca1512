"""Builds the mechanism of a rig file's section `simulated.plant`, with the payload that hangs on it."""

from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter, ValidationError

from drivers.first_fault import first_fault
from drivers.simulated.arm import Arm
from drivers.simulated.elastic_arm import ElasticArm
from drivers.simulated.hidden_effect_settings import Backlash, Elasticity
from drivers.simulated.mechanism import Mechanism
from drivers.simulated.plant_settings import ArmSettings, MountedPayload, PlantSettings, RobotSettings
from drivers.simulated.robot import Robot


class PlantSettingsError(ValueError):
    """The section `simulated.plant` is wrong: one line that names the field."""


def read_plant_settings(section: Mapping[str, Any]) -> ArmSettings | RobotSettings:
    """Check the section `simulated.plant` of a rig file.

    Raises PlantSettingsError with one line that names the first wrong field.
    """
    try:
        return TypeAdapter[ArmSettings | RobotSettings](PlantSettings).validate_python(section)
    except ValidationError as error:
        raise PlantSettingsError(first_fault(error, "simulated", "plant")) from None


def build_mechanism(
    plant: ArmSettings | RobotSettings | Mapping[str, Any],
    payload: MountedPayload | Mapping[str, Any] | None = None,
    seed: int = 0,
) -> Mechanism:
    """The mechanism with its payload mounted, at rest at its start position.

    payload : mass (kg), com (m), inertia about it (kg m²) in the last link's frame; None for none
    Raises PlantSettingsError.
    """
    if isinstance(plant, Mapping):
        plant = read_plant_settings(plant)
    if isinstance(payload, Mapping):
        payload = MountedPayload.model_validate(
            {key: payload[key] for key in MountedPayload.model_fields if key in payload}
        )
    mechanism: Mechanism
    if isinstance(plant, RobotSettings):
        mechanism = Robot(plant, payload)
    elif any(isinstance(effect, Elasticity | Backlash) for effect in plant.hidden_effects):
        mechanism = ElasticArm(plant, payload)
    else:
        mechanism = Arm(plant, payload)
    mechanism.reset(seed)
    return mechanism
