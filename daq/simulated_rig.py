"""The simulated drives of a rig: the section `simulated` of its file, turned into nodes and a mechanism.

The rig says what the operator believes, this section what is really there; where it is silent about a drive, the
drive is what the rig says.
"""

import math
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from daq.json_object import JsonObject
from daq.rig import Rig
from drivers.bus import BusSettings
from drivers.simulated.mechanism import Mechanism
from drivers.simulated.plant import build_mechanism
from drivers.simulated.rig import SimulatedRig
from drivers.simulated.settings import SimulatedAxis, SimulatedDrivesSettings
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload
from identify.recording.first_fault import first_fault


class SimulatedSection(BaseModel):
    """The section `simulated` of a rig file."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    plant: JsonObject
    """the mechanism behind the drives: `drivers.simulated.plant_settings`"""
    drives: tuple[JsonObject, ...] = ()
    """one per axis: what differs from the rig, servo gains and planned faults: `SimulatedAxis`"""
    servo_period: float = Field(default=0.001, gt=0, le=0.01)
    """s"""
    sync_timeout: float | None = Field(default=None, gt=0)
    """s without SYNC, by the wall clock, after which moving drives stop by themselves"""
    seed: int = 1


def simulated_rig(rig: Rig, payload: Payload, bus: BusSettings | None = None, seed: int = 0) -> SimulatedRig:
    """The rig's simulated drives with a payload mounted, ready to be started.

    bus : where they are to be found; the rig's own where left out
    seed : added to the rig's, so that sessions differ in their noise and each gives the same numbers every time
    Raises InputError where the rig is not simulated, or its section `simulated` is wrong.
    """
    bus = bus or rig.bus
    section = _section(rig)
    try:
        drives = _drives(rig, section, in_process=bus.interface == "virtual", seed=seed)
        return SimulatedRig(drives, bus, _mechanism(section, payload, drives.seed))
    except ValidationError as error:
        raise InputError(f"rig {rig.name}: {first_fault(error, 'simulated', 'drives')}") from None
    except ValueError as error:
        raise InputError(f"rig {rig.name}: {error}") from None


def _section(rig: Rig) -> SimulatedSection:
    if rig.simulated is None:
        raise InputError(f"rig {rig.name}: is not simulated (it has no section `simulated`)")
    try:
        return SimulatedSection.model_validate(rig.simulated)
    except ValidationError as error:
        raise InputError(f"rig {rig.name}: {first_fault(error, 'simulated')}") from None


def _mechanism(section: SimulatedSection, payload: Payload, seed: int) -> Mechanism:
    mounted = {"mass": payload.mass, "com": payload.com, "inertia": payload.inertia}
    return build_mechanism(section.plant, mounted, seed)


def _drives(rig: Rig, section: SimulatedSection, in_process: bool, seed: int) -> SimulatedDrivesSettings:
    n = len(rig.axes)
    if len(section.drives) not in (0, n):
        raise InputError(f"rig {rig.name}: simulated.drives: {n} axes need {n} entries or none")
    axes = [_axis(rig, index, section.drives[index] if section.drives else {}) for index in range(n)]
    # In the same process SYNC comes as fast as it can; only a process that hangs lets it fail, and then nobody
    # is left to record what the drives do.
    timeout = section.sync_timeout or (30.0 if in_process else 0.25)
    # In real time what moves goes on between two SYNCs however late the second one comes.
    run_on_after = max(0.02, 2.5 * rig.cycle) if rig.pacing == "real-time" else None
    return SimulatedDrivesSettings(
        run_on_after=run_on_after,
        axes=tuple(axes),
        servo_period=section.servo_period,
        sync_timeout=timeout,
        seed=section.seed + seed,
    )


def _axis(rig: Rig, index: int, given: Mapping[str, Any]) -> SimulatedAxis:
    axis = rig.axes[index]
    counts = round(axis.encoder_counts)
    # Encoder zero is where the rig's home says: counts = N (q - home) in turns.
    zero = -(rig.motor_gear @ rig.position_offset)[index] / (2 * math.pi) * counts
    rated_torque = axis.rated_torque or axis.torque_constant * (axis.rated_current or 5.0)
    believed = {
        "node": axis.node,
        "counts_per_turn": counts,
        "position_offset": round(zero),
        "rated_torque": rated_torque,
        "rated_current": axis.rated_current or rated_torque / axis.torque_constant,
    }
    return SimulatedAxis.model_validate({**believed, **given})
