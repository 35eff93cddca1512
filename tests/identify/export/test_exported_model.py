"""What of a model an export holds, and what is told as lost."""

from __future__ import annotations

import numpy as np
import pytest

from identify.export.exported_model import exported_model
from identify.export.write import write_export
from identify.identification import identify
from tests.identify.export.derivatives import along_the_record, in_formats, with_values


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


def test_presliding_is_dahls_law_of_the_positions_in_the_model_and_in_every_format(plant, tmp_path):
    """On a session that was not fitted, by a loop of our own. All dry friction builds up, so that no sign of the velocity is
    left in the torque, whose instant of a reversal the identifier knows better."""
    result = identify(plant, "usual", ["presliding"], payloads=[plant.payloads[0].name])
    values, distance = {"presliding": [40.0], "coulomb": [40.0]}, 5e-3
    result = with_values(result, values, {"presliding": {"presliding_distance": distance}})
    file = plant.sessions[-1].file
    motion, torque, alike = along_the_record(result, file)
    _, without, _ = along_the_record(with_values(result, {"presliding": [0.0], "coulomb": [0.0]}, {}), file)
    assert not alike.all()
    state = [np.sign(motion.dq[0, 0])]
    for travel in np.diff(motion.q[:, 0]):
        state.append(np.sign(travel) + (state[-1] - np.sign(travel)) * np.exp(-abs(travel) / distance))
    assert np.ptp(state) > 1.9
    assert torque[:, 0] - without[:, 0] == pytest.approx(40.0 * np.array(state), rel=1e-9, abs=1e-9)
    for name, torque_of in in_formats(exported_model(result), tmp_path).items():
        assert torque_of(motion) == pytest.approx(torque, rel=1e-9, abs=1e-9), name
