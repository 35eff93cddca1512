"""What of a model an export holds, and what is told as lost."""

from __future__ import annotations

from identify.export.exported_model import exported_model
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
