"""Torque sensors behind the gear: neither a rotor nor the friction of motor and gear is in what they measure."""

from __future__ import annotations

import numpy as np

from identify.diagnosis.diagnosis import diagnose
from identify.export.exported_model import LINKS_ALONE
from identify.export.write import write_export
from identify.identification import identify
from tests.identify.estimation.simulated_arm import Arm, Motion, experiment, record


def test_the_model_of_a_link_side_torque_is_the_links_and_the_sensor_s_offset(tmp_path):
    arm = Arm(viscous=0.0, coulomb=0.0)
    random = np.random.default_rng(3)
    raw = record(Motion(), arm, random, duration=12.0, rate=200.0, torque_noise=0.5)
    measured = experiment({"s.csv": (raw, "none")})
    result = identify(measured, "link-side")
    found = {each.name: each for each in result.document().parameters}
    assert set(found) == {"ZZ1", "MX1", "MY1", "offset1"}
    truth = {
        "ZZ1": arm.inertia,
        "MX1": arm.first_moment[0],
        "MY1": arm.first_moment[1],
        "offset1": arm.offset,
    }
    for name, value in truth.items():
        assert abs(found[name].value - value) < 4 * found[name].std_robust + 1e-3 * abs(value)
    assert not result.document().rotors
    # the bodies of a link file get no rotor either
    certificate = write_export(result, tmp_path / "arm.xml")
    assert LINKS_ALONE in certificate.remarks
    assert 'armature="0.0"' in (tmp_path / "arm.xml").read_text()
    assert identify(measured, "rigid").document().rotors
    assert {each.name for each in identify(measured, "rigid").document().parameters} >= {"ZZ1R"}
    joint = diagnose(measured, "link-side").document().joints[0]
    assert (joint.verdict, joint.missing) == ("adequate", ())
