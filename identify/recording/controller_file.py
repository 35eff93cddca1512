"""The controllers of all joints, as a file of theirs and a recording's attribute `controller` say them.

v = k_p e + k_i ∫e dt + k_r q̇_ref + k_a q̈_ref + k_t (q_ref − q_ref at the beginning) − k_v q̇ + v_0, within ± limit, e = q_ref − q
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from identify.recording.experiment_file import Number


class _Part(BaseModel):
    # Deferred: whoever identifies imports this and reads no controller.
    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)


class JointController(_Part):
    """Gains of one joint, or of the motor that drives it; the command's unit is that of the recorded command."""

    joint: str
    """name of the joint"""
    reference: str | None = None
    """column of the joint's reference position, rad or m; `qref` and the joint's number if not said"""
    position: Number
    """k_p, command per rad or m"""
    velocity: Number
    """k_v, command per rad/s or m/s"""
    reference_velocity: Number = 0.0
    """k_r, command per rad/s or m/s of the reference's velocity"""
    reference_acceleration: Number = 0.0
    """k_a, command per rad/s² or m/s² of the reference's acceleration"""
    reference_travel: Number = 0.0
    """k_t, command per rad or m that the reference has moved since the beginning"""
    integral: Number = 0.0
    """k_i, command per rad s or m s"""
    offset: Number = 0.0
    """v_0, command"""
    limit: Annotated[Number, Field(gt=0)] | None = None
    """largest command, either way"""


class ControllerFile(_Part):
    """Controllers, one for each joint."""

    coordinates: Literal["joints", "motors"] = "joints"
    """what each controller sees: its joint; or its motor, in units of its joint, which differs where a motor turns with several
    joints (`drive_gain_matrix`)"""
    joints: Annotated[tuple[JointController, ...], Field(min_length=1)]
    read_from: tuple[str, ...] = ()
    """objects of the drives that the gains were read from, with what they held"""
    left_out: tuple[str, ...] = ()
    """what the drives' controllers do beside this law, as far as it is known"""

    def same_gains(self, other: ControllerFile) -> bool:
        """Whether the law is the same."""
        return self.coordinates == other.coordinates and self.joints == other.joints
