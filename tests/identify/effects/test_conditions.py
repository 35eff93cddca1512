"""What data an effect needs: the same question for a record, for a plan and for the page."""

from __future__ import annotations

import numpy as np
import pytest

from identify.effects.catalogue import effects
from identify.effects.coverage import Coverage, JointLimits
from tests.identify.effects.summaries import TOP_SPEED, summary_of

FULL = Coverage(0.1, 0.1, 0.5, 0.5, 0.3, 0.9, 0.9, (0.25, 0.25, 0.25, 0.25))
ONE_PAYLOAD = {"payload_of_session": (1, 1)}


def unmet(**changed: object) -> dict[str, bool]:
    """Effects that a joint with these facts does not show, and whether they are prevented."""
    summary = summary_of(**{"coverage": FULL, **changed})
    obstacles = {name: effect.obstacle(summary) for name, effect in effects().items()}
    return {name: obstacle.prevents for name, obstacle in obstacles.items() if obstacle}


def test_a_record_that_holds_everything_hides_nothing():
    assert unmet() == {}


@pytest.mark.parametrize(
    ("changed", "prevented"),
    [
        ({"temperature_range": None}, {"friction-temperature"}),
        ({"temperature_range": (22.0, 22.5)}, {"friction-temperature"}),
        ({"loaded_sessions": 0}, {"payload-mass", "payload-com"}),
        (
            {"loaded_sessions": 0, "sessions": (0,)},
            {"payload-mass", "payload-com", "drive-gain", "session-offset"},
        ),
        ({"coupled_motors": ()}, {"motor-inertia", "coupled-friction"}),
        ({"joint_before": None}, {"shared-motor-sum", "shared-motor-difference"}),
        ({"joint_before": None, "joint": 3}, {"shared-motor-sum", "shared-motor-difference"}),
        ({"position_lines": ()}, {"torque-ripple"}),
        ({"load_lines": ()}, {"current-ripple"}),
        ({"speed_quantiles": np.full(9, 0.5 * TOP_SPEED)}, {"stribeck", "load-stribeck"}),
    ],
)
def test_what_is_not_in_the_data_at_all_is_prevented(changed, prevented):
    assert {name for name, prevents in unmet(**changed).items() if prevents} == prevented


def test_before_a_fit_nobody_knows_of_lines_over_position():
    assert unmet(position_lines=None, load_lines=None) == {}


def test_friction_under_load_at_low_speed_is_not_offered_where_no_load_varies():
    """Without a payload change and without gravity the load is inertia, which slow motion does not have."""
    level = unmet(axis_along_gravity=True, **ONE_PAYLOAD)
    assert level == {"load-friction": False, "load-friction-asymmetric": False, "load-stribeck": True}
    assert "load-stribeck" not in unmet(axis_along_gravity=True)  # two payloads
    assert "load-stribeck" not in unmet(axis_along_gravity=True, has_external_force=True, **ONE_PAYLOAD)
    assert unmet(**ONE_PAYLOAD)["load-stribeck"] is False  # gravity loads the joint: hard to tell, but there


@pytest.mark.parametrize(
    ("coverage", "among"),
    [
        ({"slow_backwards": 0.01}, {"stribeck", "presliding"}),
        ({"fast": 0.01}, {"viscous-quadratic", "viscous-cubic", "viscous-power"}),
        ({"backwards": 0.05}, {"viscous-asymmetric"}),
        ({"position_share": 0.3}, {"joint-spring", "friction-position", "gravity-tilt"}),
        ({"quadrants": (0.5, 0.5, 0.0, 0.0)}, {"load-friction-asymmetric", "load-stribeck"}),
    ],
)
def test_what_a_motion_shows_badly_is_said_and_tried_all_the_same(coverage, among):
    listed = unmet(coverage=Coverage(**{**FULL.__dict__, **coverage}))
    assert among <= listed.keys()
    assert not any(listed.values())


def test_slow_is_steady_and_a_tenth_of_the_top_speed():
    """A ramp through zero is not slow motion however often it passes; a creep at a twentieth is."""
    time = np.arange(0.0, 20.0, 0.01)
    limits = JointLimits((-2.0, 2.0), 2.0)
    swing = Coverage.of(np.sin(3 * time), 3 * np.cos(3 * time), -9 * np.sin(3 * time), limits=limits)
    assert max(swing.slow_forwards, swing.slow_backwards) < 0.005
    creep = np.where(time < 15.0, 0.05, 1.0)
    slow = Coverage.of(np.cumsum(creep) * 0.01, creep, np.zeros_like(time), limits=limits)
    assert slow.slow_forwards == pytest.approx(0.75)
    assert (slow.backwards, slow.fast) == (0.0, pytest.approx(0.25))
    assert slow.top_speed_share == pytest.approx(0.5)
    assert slow.quadrants is None


def test_an_effect_says_the_need_of_each_of_its_conditions():
    for effect in effects().values():
        assert effect.needs == tuple(condition.need for condition in effect.conditions)
