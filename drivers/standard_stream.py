"""The process data that we ask of a drive, as they stand on the bus: what a log of frames is read by."""

from drivers import cia402
from drivers.cia402 import CONTROLWORD, STATUSWORD, Mode
from drivers.process_data import (
    SYNCHRONOUS,
    TARGET_TORQUE,
    TORQUE_OFFSET,
    DriveStream,
    MappedEntry,
    ProcessData,
    WantedPdo,
    distribute,
    lay_out,
)
from drivers.profile import DriveProfile

# COB-IDs of the predefined connection set, CiA 301 section 7.3.3.
TPDO_BASE = (0x180, 0x280, 0x380, 0x480)
RPDO_1_BASE = 0x200

# Target object of each cyclic mode: index, subindex, NumPy's type.
TARGETS = {
    Mode.CYCLIC_SYNCHRONOUS_POSITION: (0x607A, 0, "<i4"),
    Mode.CYCLIC_SYNCHRONOUS_VELOCITY: (0x60FF, 0, "<i4"),
    Mode.CYCLIC_SYNCHRONOUS_TORQUE: (0x6071, 0, "<i2"),
    Mode.INTERPOLATED_POSITION: (0x60C1, 1, "<i4"),
}

TORQUES = {TORQUE_OFFSET: cia402.TORQUE_OFFSET, TARGET_TORQUE: cia402.TARGET_TORQUE}
"""by name of the entry: objects that carry a torque beside a target, per mille of the rated torque"""


def transmitted_entries(profile: DriveProfile, temperature: bool) -> list[MappedEntry]:
    """What a drive sends in each cycle, in the order in which it is mapped: position, command, statusword, and the
    temperature where it is asked for and there is one."""
    wanted = [
        MappedEntry("position", profile.position.index, profile.position.subindex, profile.position.kind),
        MappedEntry(
            "command",
            profile.current_reference.index,
            profile.current_reference.subindex,
            profile.current_reference.kind,
        ),
        MappedEntry("statusword", STATUSWORD, 0, "<u2"),
    ]
    if temperature and profile.temperature is not None:
        reference = profile.temperature
        wanted.append(MappedEntry("temperature", reference.index, reference.subindex, reference.kind))
    return wanted


def wanted_pdos(
    node: int,
    profile: DriveProfile,
    mode: Mode,
    *,
    temperature: bool = False,
    transmission_type: int = SYNCHRONOUS,
    torque: str | None = None,
) -> tuple[WantedPdo, ...]:
    """The PDOs that `Drive.map_stream` sets up: TPDOs first, then RPDO 1 with controlword and target.

    torque : also this entry in the RPDO: TORQUE_OFFSET (0x60B2) or TARGET_TORQUE (0x6071)
    """
    groups = distribute(transmitted_entries(profile, temperature))
    index, subindex, kind = TARGETS[mode]
    setpoint = [
        MappedEntry("controlword", CONTROLWORD, 0, "<u2"),
        MappedEntry("target", index, subindex, kind),
    ]
    if torque is not None:
        setpoint.append(MappedEntry(torque, TORQUES[torque], 0, "<i2"))
    return (
        *(
            WantedPdo("TPDO", number, base + node, transmission_type, lay_out(group))
            for number, (base, group) in enumerate(zip(TPDO_BASE, groups, strict=False), 1)
        ),
        WantedPdo("RPDO", 1, RPDO_1_BASE + node, transmission_type, lay_out(setpoint)),
    )


def standard_stream(node: int, profile: DriveProfile, mode: Mode, temperature: bool = False) -> DriveStream:
    """The stream of a drive that was mapped by `Drive.map_stream`, without asking it."""
    *transmit, receive = (
        ProcessData(pdo.can_id, pdo.transmission_type, pdo.entries)
        for pdo in wanted_pdos(node, profile, mode, temperature=temperature)
    )
    return DriveStream(node, tuple(transmit), receive)
