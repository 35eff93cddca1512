"""Known external forces, eq. (6)-(8): tau_out is the arm's own torque less what is applied to the joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import identify
from tests.identify.estimation import simulated_arm

ARM = simulated_arm.Arm()
MOTION = simulated_arm.Motion()
TRUTH = {
    "ZZ1R": ARM.inertia, "MX1": ARM.first_moment[0], "MY1": ARM.first_moment[1], "FV1": ARM.viscous,
    "FC1": ARM.coulomb, "offset1": ARM.offset,
}  # fmt: skip


def pushed(given):
    """Somebody pushes with up to 90 N m; the column `ext1` says so, or nobody wrote it down."""
    raw = simulated_arm.record(MOTION, ARM, np.random.default_rng(2), duration=40.0, torque_noise=1.0)
    push = 60.0 * np.sin(2.1 * raw.time) + 30.0 * np.sin(5.3 * raw.time + 1.0)
    command = raw.command - push[:, None] / simulated_arm.GAIN
    pushing = replace(raw, command=command, external=push[:, None] if given else None)
    return simulated_arm.experiment({"pushed": (pushing, "none")})


def test_parameters_are_those_without_the_force():
    result = identify.identify(pushed(given=True), "usual")
    for parameter in result.parameters:
        assert abs(parameter.value - TRUTH[parameter.name]) < 4 * parameter.std_robust, parameter.name
    assert result.relative_error < 0.005


def test_a_force_that_nobody_wrote_down_is_an_error_of_the_model():
    assert identify.identify(pushed(given=False), "usual").relative_error > 0.1


def test_a_known_force_tells_the_arms_scale_from_the_gears():
    """Without it only a_m / a_g could be told (the losses here are not the same both ways)."""
    a_m, a_g = 1.12, 0.95
    time = np.arange(20_000) / 500.0
    q, dq, ddq = MOTION.at(time)
    push = 60.0 * np.sin(2.1 * time) + 30.0 * np.sin(5.3 * time + 1.0)
    mx, my = ARM.first_moment
    load = ARM.inertia * ddq + simulated_arm.G * (mx * np.cos(q) - my * np.sin(q)) - push
    torque = np.where(load * dq > 0, a_m, a_g) * load + 15.0 * np.sign(dq) + 30.0 * dq
    torque += np.random.default_rng(3).standard_normal(len(time))
    raw = simulated_arm.RawSamples(time, q[:, None], torque[:, None] / simulated_arm.GAIN, push[:, None])
    result = identify.identify(simulated_arm.experiment({"pushed": (raw, "none")}), "load-velocity")
    found = {parameter.name: parameter.value for parameter in result.structured_parameters}
    assert found["a_m"] == pytest.approx(a_m, rel=0.01)
    assert found["a_g"] == pytest.approx(a_g, rel=0.01)
    assert found["ZZ1R"] == pytest.approx(ARM.inertia, rel=0.01)
    assert not any("no known load" in remark for remark in result.all_remarks)
