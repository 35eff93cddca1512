"""What gives in one joint of two, on a plant that shares no code with the identifier."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identify import load_experiment
from identify.effects.give import Give
from identify.effects.hysteresis import Backlash
from identify.identification import identify
from identify.simulation.give_fit import formed_as, give_fit
from identify.simulation.measured_motion import measured_motions
from identify.simulation.rollout import roll_out
from identify.simulation.torque_model import LINK, TorqueModel
from tests.plants.planar_arm import draw_planar_arm, record_arm


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """Two joints, the second behind a spring of 4000 N m/rad."""
    drawn = draw_planar_arm(np.random.default_rng(4), 2)
    quiet = replace(
        drawn, joints=tuple(replace(j, command_noise=0.002, slow_noise=0.0) for j in drawn.joints)
    )
    folder = tmp_path_factory.mktemp("give") / "arm"
    record_arm(folder, quiet, 1, {"elasticity": 1.0}, seed=2, duration=10.0, pace=1.5)
    return quiet, load_experiment(folder)


def test_the_spring_of_one_joint_of_two_is_found_with_the_inertia_before_it(arm):
    drawn, experiment = arm
    right, usual = identify(experiment, "usual", ["elasticity@j2"]), identify(experiment, "usual")
    given = give_fit(right.fitted)
    assert list(given.gives) == [1]
    assert given.gives[1].compliance == pytest.approx(1 / 4000.0, rel=0.1)
    assert given.gives[1].rotor == pytest.approx(drawn.joints[1].rotor_inertia, rel=0.3)
    entry = experiment.sessions[1]
    errors = []
    for result in (usual, right):
        (motion,) = measured_motions(result.fitted.record, entry)
        starts, samples = np.arange(100, 2000, 200), 100
        course = roll_out(TorqueModel(result.fitted, entry), motion, starts, samples)
        rows = starts[None, :] + np.arange(samples)[:, None]
        errors.append(np.sqrt(np.mean((course.q - motion.q[rows]) ** 2, axis=(0, 1))))
        assert ((LINK, 1) in course.memory) == (result is right)
        assert (LINK, 0) not in course.memory
    assert np.all(errors[1] < 0.5 * errors[0])


def test_what_a_fit_does_not_see_has_no_part_in_what_gives(arm):
    """Left out for the most part, a session tells less: the parameters are others, and nothing is kept for the whole fit."""
    _, experiment = arm
    fitted = identify(experiment, "usual", ["elasticity@j2"]).fitted
    file = experiment.sessions[1].file
    part = give_fit(fitted, {file: (0.0, 9.0)})
    whole = give_fit(fitted)
    assert part.gives[1] != whole.gives[1]
    assert give_fit(fitted) is whole
    assert whole.gives[1].compliance == pytest.approx(part.gives[1].compliance, rel=0.2)
    assert whole.gives[1].link_dry == part.gives[1].link_dry == 0.0
    begun = give_fit(fitted, {file: (0.0, 9.0)}, whole)
    assert begun.gives[1].compliance == pytest.approx(part.gives[1].compliance, rel=0.05)


def test_a_gap_pushed_by_motion_gives_where_motor_and_link_have_an_inertia():
    slot = SimpleNamespace(term=SimpleNamespace(effect=Backlash(), joint=0), values={"play": 0.01})
    assert formed_as(slot, {0: Give(4.0, gap=0.01)}) == "give"
    assert formed_as(slot, {1: Give(4.0, gap=0.01)}) == "state"
