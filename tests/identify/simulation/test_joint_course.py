"""What a joint did in the sessions of a fit, against the equation of the plant that was recorded."""

from __future__ import annotations

import numpy as np

from identify import load_experiment
from identify.identification import identify
from identify.simulation.joint_course import joint_courses
from tests.plants.single_joint import record, write_experiment


def test_load_its_slope_and_the_inertia_are_those_of_the_arm_with_its_payload(tmp_path):
    recorded = record({}, seed=5, duration=6.0, rate=250.0, payload_masses=(0.0, 4.0))
    result = identify(load_experiment(write_experiment(tmp_path / "bench", recorded)), "usual")
    courses = joint_courses(result.fitted, np.array([12.0, 9.0, 1.2]), 0)
    for course, mass, entry in zip(courses, (0.0, 4.0), result.fitted.entries, strict=True):
        q = result.fitted.record.samples[entry.file].q[:, 0]
        inertia, moment = 12.0 + mass * 0.9**2, 9.0 + mass * 0.9
        np.testing.assert_allclose(course.inertia, inertia, rtol=1e-9)
        load = inertia * course.ddq + 9.81 * (moment * np.cos(q) - 1.2 * np.sin(q))
        np.testing.assert_allclose(course.load, load, atol=1e-8)
        slope = -9.81 * (moment * np.sin(q) + 1.2 * np.cos(q))
        np.testing.assert_allclose(course.load_slope, slope, atol=1e-3)
        assert course.span == np.ptp(q)
