"""Every quantity of a simulated plant may be what physics allows: bounds lie at zero, but for those written out here."""

import inspect

import pytest
from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel, ValidationError

from drivers.simulated import faults, hidden_effect_settings, oddities, plant_settings, settings

# model, field -> lowest, highest, with whether the bound itself is allowed
ELSEWHERE = {
    ("ArmSettings", "longest_substep"): ((0, False), (0.01, True)),
    ("RobotSettings", "longest_substep"): ((0, False), (0.01, True)),
    ("SimulatedDrivesSettings", "servo_period"): ((0, False), (0.01, True)),
    ("Delay", "seconds"): ((0, False), (0.1, True)),
    # CiA 301: node ids, four PDOs of the drive; CiA 402: 0x60C2 is one byte, 0x6066 is ms in two; EMCY codes
    ("SimulatedAxis", "node"): ((1, True), (127, True)),
    ("OdditySettings", "receive_pdos"): ((1, True), (4, True)),
    ("OdditySettings", "fixed_interpolation"): ((1, True), (255, True)),
    ("OdditySettings", "answers_after"): ((0, True), (1, True)),
    ("OdditySettings", "boots_after"): ((0, True), (600, True)),
    ("OdditySettings", "shows_state_after"): ((0, True), (1000, True)),
    ("SimulatedAxis", "following_error_time"): ((0, True), (65, True)),
    ("FaultSettings", "emergency_code"): ((0x1000, True), (0xFFFF, True)),
    # shares and probabilities
    ("FaultSettings", "lose_probability"): ((0, True), (1, True)),
    ("FaultSettings", "late_probability"): ((0, True), (1, True)),
    ("FaultSettings", "saturate_factor"): ((0, False), (1, True)),
    ("CurrentRipple", "amplitude"): ((0, True), (1, False)),
    ("FrictionPosition", "amplitude"): ((0, True), (1, False)),
    ("ViscousPower", "exponent"): ((0, False), (3, True)),
}
MODELS = {
    model
    for module in (plant_settings, settings, oddities, faults, hidden_effect_settings)
    for _, model in inspect.getmembers(module, inspect.isclass)
    if issubclass(model, BaseModel) and model.__module__ == module.__name__
}
BOUNDED = sorted(
    (
        (model.__name__, name, field)
        for model in MODELS
        for name, field in model.model_fields.items()
        if any(isinstance(each, Gt | Ge | Lt | Le) for each in field.metadata)
    ),
    key=lambda each: each[:2],
)


@pytest.mark.parametrize(
    ("model", "name", "field"), BOUNDED, ids=lambda each: each if isinstance(each, str) else ""
)
def test_a_quantity_may_be_what_physics_allows_and_no_more(model, name, field):
    low = next(((each.gt, False) for each in field.metadata if isinstance(each, Gt)), None) or next(
        ((each.ge, True) for each in field.metadata if isinstance(each, Ge)), None
    )
    high = next(((each.lt, False) for each in field.metadata if isinstance(each, Lt)), None) or next(
        ((each.le, True) for each in field.metadata if isinstance(each, Le)), None
    )
    if name == "joint":
        assert (low, high) == ((1, True), None)  # joints are numbered from 1 in files
    elif (model, name) in ELSEWHERE:
        assert (low, high) == ELSEWHERE[model, name]
    else:
        assert low is not None
        assert low[0] == 0
        assert high is None


def test_what_nobody_states_is_off_but_for_what_is_written_out():
    """A plant without a word has neither friction nor faults nor noise."""
    friction = plant_settings.FrictionSettings()
    assert {name for name, value in friction if value} == {"stribeck_velocity", "rotor_in_load"}
    motor = plant_settings.MotorSettings(gear_ratio=2.0, torque_constant=0.1)
    assert (motor.rotor_inertia, motor.winding_resistance, motor.current_noise) == (0.0, 0.0, 0.0)
    quiet = faults.FaultSettings()
    off = {name for name, value in quiet if value in (None, 0.0, frozenset(), ())}
    assert set(quiet.model_fields_set) == set()
    assert {name for name, _ in quiet} - off == {"emergency_code", "saturate_factor", "glitch_counts"}
    assert plant_settings.MountedPayload().mass == 0.0


@pytest.mark.parametrize("ratio", [0.0, float("nan"), float("inf")])
def test_a_gear_needs_a_ratio(ratio):
    with pytest.raises(ValidationError):
        plant_settings.MotorSettings(gear_ratio=ratio, torque_constant=0.1)


def test_a_misspelt_field_is_refused():
    with pytest.raises(ValidationError, match="viscuous"):
        plant_settings.FrictionSettings.model_validate({"viscuous": 1.0})
