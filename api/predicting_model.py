"""The model of an identification on planned motion: what torque a plan will ask for."""

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from api.plan_model import Identified, RegressorModel, usual_model
from daq.excitation.plan_model import PlannedMotion
from daq.rig import Rig
from identify.effects.dry_friction import Coulomb
from identify.effects.load_velocity import SPLIT_BY_POWER_SIGN, GearFriction, LoadVelocity
from identify.effects.model import Term, coupled_motors
from identify.estimation.motor_motion import rows_on
from identify.estimation.structured import GEAR
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload
from identify.results.identification import IdentificationDocument

Array = NDArray[np.float64]

LOSSLESS = {"a_m": 1.0, "a_g": 1.0}
"""of a gear: the load itself is the rigid robot's torque, so that these parameters count from one"""


def predicting_model(rig: Rig, payload: Payload, document: IdentificationDocument | None) -> RegressorModel:
    """The model of an identification with all its effects, as found; the usual one where an effect of it needs more than a
    planned motion, or where nothing is identified."""
    usual = usual_model(rig, payload, Identified.of(document) if document is not None else None)
    if document is None:
        return usual
    with suppress(InputError):
        if document.structured is not None:
            return _LoadVelocityModel(rig, payload, document)
        if usual.is_identified:
            effects_of_model = [str(each) for each in document.effects]
            return RegressorModel(rig, "rigid", [payload], effects_of_model, Identified.of(document))
    return usual


class _LoadVelocityModel(RegressorModel):
    """Eq. (30) by its structured estimate, which has one arm and one gear of each joint.

    Raises InputError: a parameter of the rig's joints is missing, or an effect needs more than a planned motion.
    """

    def __init__(self, rig: Rig, payload: Payload, document: IdentificationDocument) -> None:
        assert document.structured is not None
        linear = Identified.of(document)
        values = {parameter.name: parameter.value for parameter in document.structured.parameters}
        joints = [axis.joint for axis in rig.axes]
        # on the far side of a shared motor the joint has dry friction of its own
        apart = {
            joints[motor] for motor in range(len(joints)) if motor in coupled_motors(rig.drive_gain, motor)
        }
        besides = [
            str(each)
            for each in document.effects
            if each.effect not in SPLIT_BY_POWER_SIGN or (each.effect == Coulomb.name and each.joint in apart)
        ]
        super().__init__(
            rig, "rigid", [payload], besides, Identified(values, linear.source, linear.constants)
        )
        self._gears: list[tuple[dict[str, float], Array]] = []
        for axis in rig.axes:
            named = [values.get(f"{symbol}@{axis.joint}", values.get(symbol)) for symbol in GEAR]
            constants = linear.constants.get((LoadVelocity.name, axis.joint))
            if constants is None or None in named:
                raise InputError(f"{linear.source}: has no gear of joint {axis.joint}")
            start = [LOSSLESS.get(symbol, 0.0) for symbol in GEAR]
            self._gears.append((dict(constants), np.array(named, float) - start))

    def torque(self, motion: PlannedMotion) -> Array:
        """(N, n) N m: load and friction, that of the gears with them."""
        torque, view = super().torque(motion), self._views(motion)
        for joint, (constants, values) in enumerate(self._gears):
            gear = Term(GearFriction(), joint)
            for row in rows_on(self._body, gear):
                torque[:, row] += view.columns(gear, row, constants) @ values
        return torque
