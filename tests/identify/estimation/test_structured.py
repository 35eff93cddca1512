"""The paper's model on an arm made by eq. (25) in closed form: linear form, structured form, power sign."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

import identify
from identify.estimation.structured import _Form, _minimise
from tests.identify.estimation import simulated_arm

G = simulated_arm.G
LEVER = 1.277


@dataclass(frozen=True)
class LoadVelocityArm:
    """Eq. (25), one value for each physical parameter."""

    inertia: float = 33.2
    first_moment: tuple[float, float] = (22.4, 0.4)
    a_m: float = 1.06
    b_m: float = 0.10
    a_g: float = 0.93
    b_g: float = 0.12
    c_m: float = 18.0
    d_m: float = 6.0
    c_g: float = 14.0
    d_g: float = 5.0
    viscous: float = 40.0
    offset: float = 9.95
    stribeck_velocity: float = 0.05

    def load(self, q, ddq, payload):
        mx, my = self.first_moment
        own = self.inertia * ddq + G * (mx * np.cos(q) - my * np.sin(q))
        return own + payload * LEVER * (LEVER * ddq + G * np.cos(q))

    def torque(self, q, dq, ddq, payload=0.0):
        load, sign = self.load(q, ddq, payload), np.sign(dq)
        fading = np.exp(-np.abs(dq) / self.stribeck_velocity)
        driving = load * dq > 0
        transferred = np.where(driving, self.a_m + self.b_m * fading, self.a_g - self.b_g * fading) * load
        dry = np.where(driving, self.c_m + self.d_m * fading, self.c_g + self.d_g * fading) * sign
        return transferred + dry + self.viscous * dq + self.offset


ARM = LoadVelocityArm()
MOTION = simulated_arm.Motion((0.9, 0.3, 0.12, 0.03), (0.05, 0.13, 0.37, 0.9))
MASSES = {"none": 0.0, "disk": 3.4584, "two disks": 6.970}


def sessions(seed=0, torque_noise=1.0):
    random = np.random.default_rng(seed)
    return {
        name: (
            simulated_arm.record(MOTION, ARM, random, duration=60.0, torque_noise=torque_noise, payload=mass),
            name,
        )
        for name, mass in MASSES.items()
    }


@pytest.fixture(scope="module")
def experiment():
    weighed = [(name, mass) for name, mass in MASSES.items() if mass]
    return simulated_arm.experiment(sessions(), weighed)


@pytest.fixture(scope="module")
def result(experiment):
    return identify.identify(experiment, "load-velocity")


def test_the_linear_form_stands_where_the_record_identifies_it(result):
    assert result.form == "linear"
    names = [parameter.name for parameter in result.parameters]
    assert names[:4] == ["a_m·ZZ1R", "a_m·MX1", "a_m·MY1", "a_m"]


def test_the_structured_estimate_has_one_value_for_each_physical_parameter(result):
    found = {parameter.name: parameter for parameter in result.structured_parameters}
    truth = {
        "ZZ1R": ARM.inertia, "MX1": ARM.first_moment[0], "MY1": ARM.first_moment[1], "a_m": ARM.a_m,
        "b_m": ARM.b_m, "a_g": ARM.a_g, "b_g": ARM.b_g, "c_m": ARM.c_m, "d_m": ARM.d_m, "c_g": ARM.c_g,
        "d_g": ARM.d_g, "FV1": ARM.viscous, "offset1": ARM.offset,
    }  # fmt: skip
    assert found.keys() == truth.keys()
    for name, value in truth.items():
        own = found[name]
        assert own.std is not None
        assert own.std_robust is not None
        # q̇_s is searched on a grid, and the quadrants change within a sample
        assert own.value == pytest.approx(value, rel=0.05, abs=5 * own.std_robust), name


def test_the_products_of_the_linear_form_are_those_of_the_structured_parameters(result):
    linear = {parameter.name: parameter for parameter in result.parameters}
    assert linear["a_m·MX1"].value == pytest.approx(ARM.a_m * ARM.first_moment[0], rel=0.02)
    assert linear["a_g·MX1"].value == pytest.approx(ARM.a_g * ARM.first_moment[0], rel=0.02)
    assert linear["a_m"].value == pytest.approx(ARM.a_m, abs=0.02)


def test_what_both_forms_have_they_know_about_equally_well(result):
    """Viscous friction and offset are linear in either form; the structured one has fewer parameters beside them."""
    linear = {parameter.name: parameter for parameter in result.parameters}
    structured = {parameter.name: parameter for parameter in result.structured_parameters}
    for name in ("FV1", "offset1"):
        for deviation in ("std", "std_robust"):
            ratio = getattr(structured[name], deviation) / getattr(linear[name], deviation)
            assert 0.5 < ratio < 1.5, (name, deviation)


def test_the_structured_estimate_predicts_as_well_as_the_linear_form(result):
    document = result.document()
    assert document.structured.relative_error < 1.02 * document.relative_error


def test_the_load_velocity_model_explains_what_the_usual_one_does_not(experiment, result):
    usual = identify.identify(experiment, "usual")
    assert result.relative_error < 0.5 * usual.relative_error


def test_the_search_finds_the_stribeck_velocity(result):
    constants = [own for own in result.document().constants if own.effect == "load-velocity"]
    assert constants[0].values["stribeck_velocity"] == pytest.approx(ARM.stribeck_velocity, rel=0.35)


def test_the_power_sign_of_the_fitted_load_is_that_of_the_truth(result):
    for file, mass in MASSES.items():
        own = result.prediction(file, "j3")
        truth = ARM.load(own.position, own.acceleration, mass)
        agree = np.sign(own.load * own.velocity) == np.sign(truth * own.velocity)
        assert agree[own.moving].mean() > 0.995


def test_the_power_sign_of_eq_26_is_no_better_outside_the_stiction_area(result):
    ours, papers, samples = 0, 0, 0
    for file, mass in MASSES.items():
        own = result.prediction(file, "j3")
        truth = np.sign(ARM.load(own.position, own.acceleration, mass) * own.velocity)
        outside = own.moving & (np.abs(own.measured) > 40.0) & (np.abs(own.velocity) > 0.05)
        ours += int((np.sign(own.load * own.velocity) == truth)[outside].sum())
        papers += int((np.sign(own.measured * own.velocity) == truth)[outside].sum())
        samples += int(outside.sum())
    assert samples > 1000
    assert papers > 0.9 * samples
    assert ours >= papers


def test_without_a_known_load_the_same_loss_is_taken_both_ways_and_said(experiment):
    found = identify.identify(experiment, "load-velocity", payloads=["none"])
    values = {parameter.name: parameter.value for parameter in found.structured_parameters}
    assert values["a_m"] + values["a_g"] == pytest.approx(2.0)
    assert any("a_m + a_g = 2" in remark for remark in found.all_remarks)


def test_a_fit_without_payload_says_what_it_predicts_for_the_payloads(experiment):
    document = identify.identify(experiment, "usual", payloads=["none"]).document()
    assert [own.role for own in document.sessions] == ["identification", "left out", "left out"]
    assert document.relative_error_left_out > document.relative_error
    assert {own.payload for own in document.payloads} == set(MASSES)


def test_a_payload_that_is_not_declared_is_refused(experiment):
    with pytest.raises(identify.InputError, match="--payload brick: not declared; payloads are none, disk"):
        identify.identify(experiment, "usual", payloads=["brick"])


def test_the_errors_by_speed_are_those_of_the_samples_in_that_range(experiment):
    found = identify.identify(experiment, "usual")
    top = found.fitted.record.top_speed[0]
    residual = measured = 0.0
    for file in MASSES:
        own = found.prediction(file, "j3")
        low = own.moving & (np.abs(own.velocity) <= 0.1 * top)
        residual += float(np.sum((own.measured - own.predicted)[low] ** 2))
        measured += float(np.sum(own.measured[low] ** 2))
    speeds = {own.range: own for own in found.document().speeds}
    assert speeds["low"].relative_error == pytest.approx(np.sqrt(residual / measured))
    assert speeds["all"].relative_error == pytest.approx(found.relative_error, rel=1e-6)
    assert speeds["high"].joints[0].joint == "j3"


@pytest.mark.parametrize("start", [(-1.2, 1.0), (3.0, -4.0), (0.0, 0.0)])
def test_the_search_goes_down_rosenbrock_s_valley_to_its_end(start):
    """100 (y - x²)² + (1 - x)², least at (1, 1) (Rosenbrock 1960): steps that fail must be made shorter."""

    class Valley:
        def coefficients(self, theta):
            x, y = theta
            return np.array([10 * (y - x * x), x]), np.array([[-20 * x, 10.0], [1.0, 0.0]])

    rows = np.column_stack([np.eye(2), [0.0, 1.0], [0.0, 0.0]])
    assert _minimise(Valley(), rows, np.array(start)) == pytest.approx([1.0, 1.0], abs=1e-6)


def test_losses_that_are_tied_are_reported_both_ways_with_one_deviation():
    """Where no known load tells them apart, a_m = 1 + x and a_g = 1 − x for the one x that is estimated."""
    names = [("ZZ1", "j1", "kg m^2", None)]
    names += [(symbol, joint, "1", None) for joint in ("j1", "j2") for symbol in ("a_m", "b_m")]
    gears = [(None, None, np.array([1, 2]), True), (None, None, np.array([3, 4]), True)]
    theta, std, robust = np.array([7.0, 0.25, 3.0, 0.5, 4.0]), np.arange(5) + 10.0, np.arange(5) + 20.0
    reported = _Form.reported(SimpleNamespace(names=names, gears=gears), theta, std, robust)  # type: ignore[arg-type]
    listed = [
        (f"{symbol} {joint}", *figures) for (symbol, joint, _, _), *figures in zip(*reported, strict=True)
    ]
    assert listed == [
        ("ZZ1 j1", 7.0, 10.0, 20.0),
        ("a_m j1", 1.25, 11.0, 21.0),
        ("b_m j1", 3.0, 12.0, 22.0),
        ("a_g j1", 0.75, 11.0, 21.0),
        ("a_m j2", 1.5, 13.0, 23.0),
        ("b_m j2", 4.0, 14.0, 24.0),
        ("a_g j2", 0.5, 13.0, 23.0),
    ]
