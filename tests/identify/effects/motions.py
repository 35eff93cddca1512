"""A block of motion in closed form, for effects whose columns are formulas of it."""

from __future__ import annotations

import numpy as np

from identify.effects.motion import BlockMemory, JointMotion

PERIOD = 1e-3


def motion_of(**changed: object) -> JointMotion:
    """q = 0.8 sin(w t): half a second of it, with a load and a torque of their own."""
    time = np.arange(0.0, 0.5, PERIOD)
    w = 2 * np.pi * 1.3
    q, dq, ddq = 0.8 * np.sin(w * time), 0.8 * w * np.cos(w * time), -0.8 * w**2 * np.sin(w * time)
    facts: dict[str, object] = {
        "joint": 0,
        "time": time,
        "session_time": time,
        "experiment_time": 100.0 + time,
        "q": q,
        "dq": dq,
        "ddq": ddq,
        "direction": np.sign(dq),
        "period": PERIOD,
        "load": 30.0 * np.cos(q) + 2.0 * ddq,
        "model_torque": 30.0 * np.cos(q) + 2.0 * ddq + 5.0 * np.sign(dq),
        "known_load": 7.0 * np.cos(q),
        "payload": 1,
        "session": 1,
        "temperature": None,
        "motor_velocity": 2.0 * dq,
        "motor_acceleration": 2.0 * ddq,
        "motor_share": 0.5,
        "positions": q[:, None],
        "inertial": np.column_stack([ddq, np.cos(q)]),
        "memory": BlockMemory(),
        "load_slope_of": lambda: -30.0 * np.sin(q),
        "gravity_gradient_of": lambda: np.column_stack([np.cos(q), np.sin(q)]),
        "payload_gradient_of": lambda: np.column_stack([q, dq, ddq]),
        "payload_columns_of": lambda: np.zeros((len(time), 10)),
    }
    return JointMotion(**{**facts, **changed})  # type: ignore[arg-type]
