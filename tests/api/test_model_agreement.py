"""A model's torque beside what was measured: an arm of one and of two joints in closed form, with coloured noise."""

import re
from dataclasses import replace

import numpy as np
import pytest

from api.model_agreement import ModelTorque, disagreements

CYCLES = 4000
TIME = np.arange(CYCLES) * 5e-3
LEVER = 1.2
MASS = 3.5


@pytest.fixture(scope="module")
def model():
    """Two pendulums that swing at different rates, with dry and viscous friction."""
    angle = 1.2 * np.column_stack([np.sin(0.9 * TIME), np.cos(1.3 * TIME) + 0.3 * np.sin(2.9 * TIME)])
    speed, turning = (np.gradient(each, TIME, axis=0) for each in (angle, np.gradient(angle, TIME, axis=0)))
    kilogram = LEVER**2 * turning + 9.81 * LEVER * np.cos(angle)
    rigid = 25.0 * turning + 9.81 * 18.0 * np.sin(angle + 0.4) + MASS * kilogram
    beside = 20.0 * np.sign(speed) + 30.0 * speed
    whole = np.sqrt(np.mean((rigid + beside) ** 2, axis=0))
    return ModelTorque(rigid, beside, kilogram, 0.05 * whole, MASS)


def measured(model, seed, rigid=1.0, beside=1.0, mass=0.0):
    """With noise of a tenth of the torque, its correlation falling to a third in 0.1 s."""
    noise = np.random.default_rng(seed).normal(0.0, 1.0, model.rigid.shape)
    for row in range(1, CYCLES):
        noise[row] += 0.95 * noise[row - 1]
    noise *= 2.0 * model.error / noise.std(axis=0)
    return rigid * model.rigid + beside * model.beside + mass * model.kilogram + noise


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("rigid", "beside"), [(1.0, 1.0), (1.1, 0.8), (0.9, 1.3), (1.0, 2.5), (0.75, 0.75)])
def test_a_right_model_and_one_that_helps_are_sent(model, seed, rigid, beside):
    """Friction may have grown to whatever it is: what is sent takes its share of it."""
    stated = replace(
        model, mass=50.0
    )  # all that a rigid share of 0.75 to 1.1 could be is within a third of this payload
    assert disagreements(measured(model, seed, rigid, beside), stated, ["j1", "j2"]) == []


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(
    ("rigid", "beside", "words"),
    [
        (0.5, 0.5, "torque of arm and payload"),
        (2.0, 2.0, "torque of arm and payload"),
        (1.0, 0.5, "0.[45]. times the model's friction"),
        (1.0, -1.0, "-[01].* times the model's friction"),
        (-1.0, -1.0, "torque of arm and payload"),
    ],
    ids=["doubled", "halved", "friction doubled", "friction reversed", "reversed"],
)
def test_a_wrong_model_is_told_joint_by_joint_in_its_part(model, seed, rigid, beside, words):
    found = disagreements(measured(model, seed, rigid, beside), model, ["j1", "j2"])
    assert {each[:3] for each in found} == {"j1:", "j2:"}
    assert re.search(words, found[0])


@pytest.mark.parametrize("seed", range(5))
def test_a_payload_other_than_stated_is_weighed(model, seed):
    for other in (-MASS, 0.9 * MASS):
        (words,) = disagreements(measured(model, seed, mass=other), model, ["j1", "j2"])
        assert f"{MASS:.3g} kg was stated; check what is mounted" in words
        weighed = float(words.split("the payload weighs ")[1].split(" kg")[0])
        assert weighed == pytest.approx(MASS + other, abs=0.5)
    for within in (-0.2 * MASS, 0.2 * MASS):
        assert disagreements(measured(model, seed, mass=within), model, ["j1", "j2"]) == []


def test_a_part_that_is_next_to_nothing_is_no_reason(model):
    """A joint without gravity whose inertia makes a hundredth of its torque, and that share is half of the model's."""
    small = replace(model, rigid=0.02 * model.rigid, kilogram=np.zeros_like(model.kilogram))
    assert disagreements(measured(small, 0, rigid=0.5), small, ["j1", "j2"]) == []
