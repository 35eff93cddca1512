"""Whether a mass, as weighed or typed, is that of the payload that a session is meant for."""

from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload

TOLERANCE = 0.005
"""of the payload's mass: more is another payload, or a scale that is not tared"""
LEAST_TOLERANCE = 0.005
"""kg"""


def require_mass(payload: Payload, mass: float) -> None:
    """Raises InputError where `mass`, kg as weighed, is not the payload's."""
    tolerance = max(LEAST_TOLERANCE, TOLERANCE * payload.mass)
    if not abs(mass - payload.mass) <= tolerance:
        raise InputError(
            f"payload {payload.name}: weighs {payload.mass:g} kg in the rig file, {mass:g} kg on the scale, and they may differ "
            f"by {tolerance:.3g} kg; mount that payload and weigh it again, or choose the payload that is mounted"
        )
