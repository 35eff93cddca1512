"""What the loop of a proof in cyclic torque mode is made of: inertia and gravity of the model, beside those of the arm."""

from __future__ import annotations

import numpy as np
import pytest

from api.compensation import torque_ahead
from api.position_loop import position_loop
from daq.excitation.excitation_plan import ExcitationPlan
from daq.rig import Rig
from identify.export.exported_model import exported_model
from identify.export.record_error import Motion
from identify.identification import Identification, identify
from identify.recording import InputError, load_experiment
from tests.api.driven_arm import INERTIA, short_plan, write_driven_arm
from tests.api.test_compensation_by_torque import held_by_us


@pytest.fixture(scope="module")
def rig() -> Rig:
    return held_by_us(Rig.load("rx130l-joint3-simulated"))


@pytest.fixture(scope="module")
def plan() -> ExcitationPlan:
    return short_plan("short")


@pytest.fixture(scope="module")
def result(rig, tmp_path_factory) -> Identification:
    folder = tmp_path_factory.mktemp("loop") / "arm"
    write_driven_arm(folder, rig)
    return identify(load_experiment(folder), "usual")


def test_gains_are_those_of_the_arm_s_inertia_in_the_drive_s_units(rig, plan, result):
    loop = torque_ahead(result, rig, plan, rig.payload("none"), "whole", 0.6).loop
    (crossover,) = loop.crossover
    counts, amperes = 95.0 * 131072 / (2 * np.pi), 1.0 / (95.0 * 0.37)
    per_mille = 1000.0 * 0.37 / 2.22
    # derivative = J w / (1 + 1/100), in N m s/rad; the zeros at w / 10
    derivative = INERTIA * crossover / 1.01 * amperes * per_mille / counts
    assert loop.derivative[0] == pytest.approx(derivative, rel=0.05)
    assert loop.proportional[0] == pytest.approx(0.2 * crossover * derivative, rel=0.05)
    assert loop.integral[0] == pytest.approx(0.01 * crossover**2 * derivative, rel=0.05)
    assert loop.bound[0] == 1799
    faster = rig.model_copy(update={"cycle": 0.001})
    twice = torque_ahead(result, faster, plan, rig.payload("none"), "whole", 0.6).loop
    assert twice.crossover[0] == pytest.approx(2.0 * crossover, rel=0.01)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"axes": {"held_by": None}}, r"axis j3: gravity acts on it .*state held_by: brake or balance"),
        ({"cycle": 0.06}, r"j3: at a cycle of 60 ms no position loop over the bus leaves 60° of phase"),
        (
            {"supervision": 0.2},
            r"j3: a torque that stands for 0\.2 s, until the drive stops by itself, could bring it",
        ),
    ],
)
def test_what_a_careful_person_would_not_hold_over_the_bus_is_refused_in_words(
    rig, plan, result, changes, words
):
    changed = held_by_us(rig, **changes.get("axes", {}))
    changed = changed.model_copy(update={"cycle": changes.get("cycle", rig.cycle)})
    if "supervision" in changes:
        slow = rig.supervision.model_copy(update={"torque_timeout": changes["supervision"]})
        changed = changed.model_copy(update={"supervision": slow})
    with pytest.raises(InputError, match=words):
        torque_ahead(result, changed, plan, rig.payload("none"), "whole", 0.6)


def test_axes_that_share_a_motor_are_refused(result, plan):
    wrist = held_by_us(Rig.load("tx40-simulated"))
    q, dq, ddq = np.zeros((3, 10, 6))
    motion = Motion(np.arange(10.0), q, dq, ddq, None, wrist.payload("none"))
    with pytest.raises(InputError, match="for axes with a motor each; here one motor moves several joints"):
        position_loop(exported_model(result), wrist, motion, 0.6)
