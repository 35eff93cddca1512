"""What a plan tells about a model: standard deviations, and what it cannot show."""

import numpy as np
import pytest

from daq.excitation import ExcitationPlan, Move, standard_plan
from daq.excitation.information import INDEPENDENT_RATE, information
from daq.excitation.optimal_excitation import information_of
from daq.excitation.plan_model import PlannedMotion
from tests.daq.excitation.planned_pendulum import Pendulum, request_of


def test_the_expected_deviations_are_those_of_a_monte_carlo_experiment(rig, planned):
    """Least squares on 2000 noisy repetitions of the plan, 20 independent samples a second."""
    model, sigma = Pendulum(), 2.0
    motion = PlannedMotion.of(planned, rig.payloads[0], 1.0 / INDEPENDENT_RATE)
    expected = information(model, [motion], np.array([sigma])).deviations()
    ((_, columns),) = model.rows(motion)
    moving = motion.dq[:, 0] != 0.0
    columns = columns[moving]
    random = np.random.default_rng(1)
    torque = (columns @ model.values)[:, np.newaxis] + sigma * random.standard_normal((len(columns), 2000))
    estimates = np.linalg.lstsq(columns, torque, rcond=None)[0]
    assert estimates.std(axis=1) == pytest.approx(np.array(expected), rel=0.06)


def test_more_payload_sessions_and_less_noise_tell_more(rig, planned):
    once = information_of(planned, request_of(rig, payloads=rig.payloads[:1]))
    thrice = information_of(planned, request_of(rig))
    quiet = information_of(planned, request_of(rig, noise=np.array([1.0])))
    assert np.array(thrice.deviations()) == pytest.approx(
        np.array(once.deviations()) / np.sqrt(3.0), rel=1e-6
    )
    assert np.array(quiet.deviations()) == pytest.approx(np.array(thrice.deviations()) / 2.0, rel=1e-9)


def test_parameters_that_only_show_in_combination_are_named_and_have_no_deviation(rig, planned):
    found = information_of(planned, request_of(rig, model=Pendulum(twice=True)))
    assert found.inseparable() == [[3, 4]]
    deviations = found.deviations()
    assert deviations[3] is None
    assert deviations[4] is None
    assert None not in deviations[:3]
    assert found.condition_number is None


def test_a_slow_move_alone_cannot_tell_inertia_from_nothing(rig):
    plan = ExcitationPlan(joints=("j3",), start=(0.0,), phases=(Move(to=(0.3,), duration=20.0, ramp=5.0),))
    slow = information_of(plan, request_of(rig)).deviations()[0]
    excited = information_of(standard_plan(rig, 40.0), request_of(rig)).deviations()[0]
    assert slow is None or slow > 30.0 * excited
