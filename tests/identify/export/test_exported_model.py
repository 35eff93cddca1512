"""What of a model an export holds, and what is told as lost."""

from __future__ import annotations

import pytest

from identify.export.exported_model import exported_model
from identify.export.write import write_export
from identify.identification import identify


def test_effects_beside_eq_30_are_kept_with_their_memory_or_told_as_lost(plant):
    model = exported_model(identify(plant, "load-velocity", ["presliding", "elasticity", "gravity-tilt"]))
    names = [torque.effect for torque in model.torques]
    kept = {"load-velocity", "viscous", "offset", "presliding", "elasticity", "gravity-tilt"}
    assert kept == set(names)
    assert [memory.effect for memory in model.memories] == ["presliding"]
    assert model.lost == ()
    assert [torque.formulas for torque in model.torques if torque.tilts_gravity] == [
        ("gravity_1", "gravity_2")
    ]


@pytest.mark.parametrize("ending", ["py", "urdf"])
def test_what_belongs_to_single_sessions_is_in_no_model_of_the_machine_and_is_said_once(
    plant, tmp_path, ending
):
    result = identify(plant, "usual", ["session-offset"])
    model = exported_model(result)
    assert {torque.effect for torque in model.torques} == {"viscous", "coulomb", "offset"}
    assert model.lost == ()
    file = tmp_path / f"arm.{ending}"
    certificate = write_export(result, file)
    assert sum("session-offset" in remark for remark in certificate.remarks) == 1
    (joint,) = certificate.joints
    assert "session-offset" not in (*joint.kept, *joint.approximated, *joint.lost)
    assert "offset_change" not in file.read_text()
