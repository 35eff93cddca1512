"""A joint as a record of two sessions shows it: all that effects ask of it, to be changed by a test."""

from __future__ import annotations

import numpy as np

from identify.effects.motion import JointSummary

TOP_SPEED = 2.0
LARGEST_LOAD = 80.0


def summary_of(**changed: object) -> JointSummary:
    facts: dict[str, object] = {
        "joint": 0,
        "name": "j1",
        "revolute": True,
        "position_range": (-1.0, 1.0),
        "position_quantiles": np.linspace(-1.0, 1.0, 17),
        "maximum_speed": TOP_SPEED,
        "speed_quantiles": TOP_SPEED * np.array([0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99]),
        "speed_resolution": 1e-3,
        "position_resolution": 1e-5,
        "load_range": (-LARGEST_LOAD, LARGEST_LOAD),
        "own_inertia": 3.0,
        "payloads": ("none", "disk"),
        "payload_masses": (0.0, 5.0),
        "sessions": (0, 1),
        "payload_of_session": (0, 1),
        "session_durations": (60.0, 60.0),
        "temperature_range": (22.0, 41.0),
        "has_external_force": False,
        "motor_ratio": 100.0,
        "coupled_motors": (0,),
        "period": 1e-3,
        "axis_along_gravity": False,
        "position_lines": (40.0, 80.0),
        "load_lines": (2.0,),
        "lines_searched": 100,
        "loaded_sessions": 1,
        "joint_before": "j0",
    }
    return JointSummary(**{**facts, **changed})  # type: ignore[arg-type]
