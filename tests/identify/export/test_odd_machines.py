"""A machine with a sliding joint, motors that share an axis, names that no language allows, and an effect of the user's that is
no number somewhere: exported right to every format."""

from __future__ import annotations

import numpy as np
import pytest

from identify.export.exported_model import exported_model
from identify.export.formula_torque import module_of, module_torque
from identify.export.record_error import Motion
from identify.export.write import KINDS, write_export
from identify.identification import identify
from tests.identify.export.identified_torque import of_the_model
from tests.identify.export.recorded_machine import recorded_machine

NAMES = ("if", "1st-axis", 'für <z> & "x" */ *)')


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    effect = tmp_path_factory.mktemp("effects") / "root.yaml"
    effect.write_text(
        "name: root\ncolumns: ['sqrt(dq)', '1 / q * 0.01']\nexplanation: A root of the speed forwards.\n"
    )
    joints = [
        {"name": NAMES[0], "type": "revolute", "alpha": 0.0, "d": 0.0, "r": 0.3},
        {"name": NAMES[1], "type": "revolute", "alpha": 1.2, "d": 0.1, "r": 0.0},
        {"name": NAMES[2], "type": "prismatic", "alpha": -0.7, "d": 0.2, "r": 0.1},
    ]
    gain = [[20.0, 0.0, 0.0], [0.0, -30.0, 8.0], [0.0, 0.0, 25.0]]
    experiment = recorded_machine(
        'odd "machine" */ (* ü', joints, gain, seconds=4.0, swing=0.3, seed=3, effects=[effect]
    )
    return identify(experiment, "usual", ["root@1st-axis", "presliding@if", "coupled-friction"])


@pytest.mark.parametrize("ending", sorted(KINDS))
def test_every_format_holds_the_machine_and_says_what_it_loses(result, tmp_path, ending):
    certificate = write_export(result, tmp_path / f"1 é-arm.v2{ending}")
    header = ["1 é-arm.v2.h"] if ending == ".c" else []
    written = [f"1 é-arm.v2{ending}", f"1 é-arm.v2{ending}.certificate.json", *header]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(written)
    assert tuple(joint.joint for joint in certificate.joints) == NAMES
    if certificate.not_measured is not None:
        assert "not installed" in certificate.not_measured or "C compiler" in certificate.not_measured
        return
    for joint in certificate.joints:
        assert joint.relative_error_export is not None
        if ending in (".urdf", ".sdf"):
            assert joint.lost
        elif ending == ".xml" and (joint.lost or joint.approximated):
            assert joint.joint != NAMES[2]  # whose friction, and that of its shared motor, the format holds
        else:
            assert joint.lost == joint.approximated == ()
            assert joint.relative_difference < 1e-9


def test_what_is_no_number_is_0_in_the_model_and_in_its_formulas(result):
    random = np.random.default_rng(9)
    q, dq, ddq = (
        random.uniform(-0.5, 0.5, (40, 3)),
        random.uniform(-1, 1, (40, 3)),
        random.uniform(-3, 3, (40, 3)),
    )
    q[0] = 0.0
    motion = Motion(np.linspace(0, 1, 40), q, dq, ddq, None, result.experiment.payloads[0])
    model = exported_model(result)
    assert model.may_have_no_value
    torque = module_torque(module_of(model), model)(motion)
    assert np.isfinite(torque).all()
    assert torque == pytest.approx(of_the_model(result, motion), rel=1e-9, abs=1e-9)
