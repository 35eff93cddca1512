"""What a plan says of the current that it will take."""

import pytest

from daq.excitation import plan_report
from daq.excitation.plan_report import GENTLER, GENTLEST, make_plan
from identify.recording.errors import InputError
from tests.daq.excitation.planned_pendulum import Pendulum, request_of


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


def test_a_plan_becomes_no_gentler_than_the_gentlest(rig, monkeypatch):
    """A current that stays beyond its limit, however slowly the arm moves."""
    shares = []
    monkeypatch.setattr(
        plan_report, "optimal_plan", lambda request, progress: shares.append(request.dynamic_share)
    )
    monkeypatch.setattr(plan_report, "current_violations", lambda request, plan: True)
    monkeypatch.setattr(plan_report, "too_heavy_at_rest", lambda request, plan: False)
    monkeypatch.setattr(plan_report, "judge", lambda request, plan: request)
    gentlest = make_plan(request_of(rig, model=Pendulum()))
    assert shares == pytest.approx([GENTLER**step for step in range(len(shares))])
    assert gentlest.dynamic_share == shares[-1]
    assert GENTLER * shares[-1] < GENTLEST <= shares[-1]
