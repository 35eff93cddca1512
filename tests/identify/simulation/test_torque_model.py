"""The torque of a fitted model at single instants, against the arm's own equation of motion (34)."""

from __future__ import annotations

import numpy as np
import pytest

import identify
from identify.simulation.torque_model import TorqueModel, Windows
from tests.identify.estimation.simulated_arm import Arm, Motion, experiment, record

ARM, MASS, LENGTH = Arm(), 3.0, 1.277


@pytest.fixture(scope="module")
def result():
    made = {
        name: (record(Motion(), ARM, np.random.default_rng(1), duration=20.0, payload=mass), payload)
        for name, payload, mass in (("a", "none", 0.0), ("b", "disc", MASS))
    }
    return identify.identify(experiment(made, payloads=[("disc", MASS)]), "usual")


def model_in(result, file):
    entry = next(each for each in result.experiment.sessions if each.file == file)
    return TorqueModel(result.fitted, entry)


def windows(count=6, **changes):
    random = np.random.default_rng(2)
    q, dq = random.uniform(-1.5, 1.5, (count, 1)), random.uniform(0.2, 2.0, (count, 1))
    dq[::2] *= -1
    facts = {"time": np.zeros(count), "q": q, "dq": dq, "direction": np.sign(dq), **changes}
    return Windows(**facts), random.uniform(-5, 5, (count, 1))


@pytest.mark.parametrize(("file", "mass"), [("a", 0.0), ("b", MASS)])
def test_the_torque_is_that_of_the_arm_with_what_the_session_carries(result, file, mass):
    state, acceleration = windows()
    truth = ARM.torque(state.q, state.dq, acceleration, mass)
    assert model_in(result, file).torque(state, acceleration) == pytest.approx(truth, abs=0.3)


@pytest.mark.parametrize(("file", "mass"), [("a", 0.0), ("b", MASS)])
def test_the_slope_over_the_acceleration_is_the_inertia_as_it_is_felt(result, file, mass):
    state, acceleration = windows()
    model = model_in(result, file)
    torque, slope = model.with_slope(state, acceleration)
    assert slope.shape == (6, 1, 1)
    assert slope[:, 0, 0] == pytest.approx(np.full(6, ARM.inertia + mass * LENGTH**2), rel=2e-3)
    assert torque == pytest.approx(model.torque(state, acceleration), rel=1e-12)


def test_friction_is_what_the_torque_has_beside_the_rigid_arm(result):
    state, acceleration = windows()
    model = model_in(result, "b")
    beside = model.torque(state, acceleration) - model.rigid_torque(state, acceleration)
    truth = ARM.viscous * state.dq + ARM.coulomb * state.direction + ARM.offset
    assert beside == pytest.approx(truth, abs=0.3)


@pytest.mark.parametrize("direction", [-1.0, 0.0, 1.0])
def test_a_joint_about_to_move_from_rest_is_held_back_by_dry_friction_the_way_it_tries(result, direction):
    still = np.zeros((6, 1))
    state, acceleration = windows(dq=still, direction=np.full((6, 1), direction))
    model = model_in(result, "a")
    beside = model.torque(state, acceleration) - model.rigid_torque(state, acceleration)
    assert beside == pytest.approx(np.full((6, 1), ARM.offset + ARM.coulomb * direction), abs=0.2)


def test_an_external_force_takes_its_share_of_the_torque(result):
    state, acceleration = windows()
    pushed, _ = windows(external=np.linspace(-4, 4, 6)[:, None])
    model = model_in(result, "a")
    less = model.torque(state, acceleration) - model.torque(pushed, acceleration)
    assert less == pytest.approx(np.linspace(-4, 4, 6)[:, None], abs=1e-9)


def test_windows_are_repeated_one_copy_behind_the_other():
    state, _ = windows(
        external=np.arange(6.0)[:, None],
        temperature=np.arange(6.0)[:, None] + 20,
        memory={("presliding", 0): np.arange(6.0)},
    )
    thrice = state.repeated(3)
    for name in ("time", "q", "dq", "direction", "external", "temperature"):
        one, three = getattr(state, name), getattr(thrice, name)
        np.testing.assert_array_equal(three, np.concatenate([one, one, one]))
    assert thrice.memory["presliding", 0].tolist() == [*range(6)] * 3
    bare, _ = windows()
    assert bare.repeated(2).external is None
    assert bare.repeated(2).temperature is None
