"""The catalogue of effects: the built-in ones, and those that installed packages add by entry point."""

from dataclasses import asdict
from functools import cache
from importlib.metadata import entry_points

from identify.effects import (
    actuation,
    dry_friction,
    hysteresis,
    payload_errors,
    position,
    transmission,
    viscous,
)
from identify.effects.effect import Effect
from identify.recording.errors import InputError

ENTRY_POINT_GROUP = "coulomb.effects"

BUILT_IN: tuple[type[Effect], ...] = (
    viscous.Viscous,
    dry_friction.Coulomb,
    dry_friction.Offset,
    viscous.ViscousAsymmetric,
    viscous.ViscousQuadratic,
    viscous.ViscousCubic,
    viscous.ViscousPower,
    viscous.Stribeck,
    dry_friction.LoadFriction,
    dry_friction.LoadFrictionAsymmetric,
    dry_friction.LoadStribeck,
    dry_friction.FrictionPosition,
    dry_friction.FrictionTemperature,
    dry_friction.FrictionWarmup,
    hysteresis.Presliding,
    hysteresis.Backlash,
    position.TorqueRipple,
    position.CurrentRipple,
    position.JointSpring,
    actuation.GainSaturation,
    actuation.DriveGain,
    actuation.Delay,
    transmission.Elasticity,
    transmission.MotorInertia,
    transmission.CoupledFriction,
    payload_errors.PayloadMass,
    payload_errors.PayloadCentre,
    payload_errors.GravityTilt,
)


@cache
def effects() -> dict[str, Effect]:
    """All effects by name, in the order of the catalogue; installed packages' own come last."""
    found = {kind.name: kind() for kind in BUILT_IN}
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        own = entry.load()()
        if own.name in found:
            raise InputError(
                f"entry point {entry.name}: an effect named '{own.name}' is already in the catalogue"
            )
        found[own.name] = own
    return found


def catalogue() -> list[dict[str, object]]:
    """The catalogue as the contract's JSON (section 3, `effects --json`)."""
    return [
        {
            "effect": effect.name,
            "title": effect.title or effect.name,
            "group": effect.group,
            "equation": effect.equation,
            "explanation": effect.explanation,
            "regressors": list(effect.regressors),
            "parameters": [{"name": each.name, "unit": each.unit} for each in effect.parameters],
            "needs": list(effect.needs),
            "source": effect.source,
            "picture": asdict(effect.picture),
            "indistinguishable_from": list(effect.confusable),
        }
        for effect in effects().values()
    ]
