"""What a plan tells about a model: standard deviations, optimality, what it cannot show."""

import numpy as np
import pytest

from daq.excitation import ExcitationPlan, Move, standard_plan, violations
from daq.excitation.information import INDEPENDENT_RATE, information
from daq.excitation.optimal_excitation import Request, information_of, optimal_plan, score
from daq.excitation.plan_model import PlanJudgement, PlannedMotion, PlannedParameter
from daq.excitation.plan_report import make_plan
from daq.rig import Rig
from identify.recording.errors import InputError


class Pendulum:
    """τ = J q̈ + MX g cos q + FV q̇ + FC sign q̇, the payload's known torque apart; written for these
    tests.
    """

    name = "pendulum"
    source = "measured on a bench"

    def __init__(self, values=(31.0, 21.0, 48.0, 20.0), is_identified=True, twice=False) -> None:
        names = ["J", "MX", "FV", "FC", *(["FC again"] if twice else [])]
        self.values = np.array([*values, *([0.0] if twice else [])])
        self.is_identified = is_identified
        self.twice = twice
        self.parameters = tuple(
            PlannedParameter(name, "j3", "", None, value)
            for name, value in zip(names, self.values.tolist(), strict=True)
        )

    def rows(self, motion):
        q, dq, ddq = motion.q[:, 0], motion.dq[:, 0], motion.ddq[:, 0]
        columns = [ddq, 9.81 * np.cos(q), dq, np.sign(dq)] + [np.sign(dq)] * self.twice
        return [(np.arange(len(columns)), np.column_stack(columns))]

    def load(self, motion):
        q, ddq = motion.q, motion.ddq
        arm = self.values[0] * ddq + self.values[1] * 9.81 * np.cos(q)
        return arm + motion.payload.mass * 1.277 * (1.277 * ddq + 9.81 * np.cos(q))

    def judge(self, motions):
        return PlanJudgement((), ())

    def torque(self, motion):
        return self.load(motion) + self.values[2] * motion.dq + self.values[3] * np.sign(motion.dq)


@pytest.fixture(scope="module")
def rig() -> Rig:
    return Rig.load("rx130l-joint3-simulated")


def request_of(rig, **changes) -> Request:
    given = {"model": Pendulum(), "payloads": rig.payloads, "seconds": 40.0, "noise": np.array([2.0])}
    return Request(rig=rig, **(given | changes))


@pytest.fixture(scope="module")
def planned(rig) -> ExcitationPlan:
    return optimal_plan(request_of(rig))


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


@pytest.mark.parametrize("criterion", ["d-optimal", "condition"])
def test_the_optimal_plan_is_better_than_the_standard_one_and_keeps_every_limit(rig, criterion):
    request = request_of(rig, criterion=criterion)
    plan = optimal_plan(request)
    assert violations(plan, rig) == []
    assert plan.duration <= 40.0 + 1e-6
    best, standard = information_of(plan, request), information_of(standard_plan(rig, 40.0), request)
    scale = standard.scale
    assert score(best, criterion, scale) > score(standard, criterion, scale) + 0.1


def test_the_same_request_gives_the_same_plan(rig, planned):
    assert optimal_plan(request_of(rig)).phases == planned.phases
    assert optimal_plan(request_of(rig, seed=5)).phases != planned.phases


def test_where_loads_are_known_a_plan_slows_down_to_stay_below_the_current_limit(rig):
    heavy = Pendulum(values=(90.0, 30.0, 48.0, 20.0))
    report = make_plan(request_of(rig, model=heavy, payloads=rig.payloads[:1]))
    assert report.request.dynamic_share < 1.0
    assert report.peak_current.max() <= rig.axes[0].limits.current
    assert any("of their limits" in remark for remark in report.remarks)


def test_a_load_that_no_motion_could_carry_is_refused_with_joint_time_and_value(rig):
    too_heavy = Pendulum(values=(31.0, 120.0, 48.0, 20.0))
    with pytest.raises(InputError, match=r"joint j3: predicted current -?\d+\.\d+ A at \d+\.\d+ s is beyond"):
        make_plan(request_of(rig, model=too_heavy))


def test_an_assumed_load_forbids_nothing_but_is_remarked_upon(rig):
    too_heavy = Pendulum(values=(31.0, 120.0, 48.0, 20.0), is_identified=False)
    report = make_plan(request_of(rig, model=too_heavy))
    assert any("predicted current" in remark and "measured on a bench" in remark for remark in report.remarks)
