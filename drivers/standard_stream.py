"""The process data that we ask of a drive, as they stand on the bus: what a log of frames is read by."""

from drivers.cia402 import CONTROLWORD, STATUSWORD, Mode
from drivers.process_data import SYNCHRONOUS, DriveStream, MappedEntry, ProcessData, distribute, lay_out
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


def standard_stream(node: int, profile: DriveProfile, mode: Mode, temperature: bool = False) -> DriveStream:
    """The stream of a drive that was mapped by `Drive.map_stream`, without asking it."""
    groups = distribute(transmitted_entries(profile, temperature))
    transmit = tuple(
        ProcessData(base + node, SYNCHRONOUS, lay_out(group))
        for base, group in zip(TPDO_BASE, groups, strict=False)
    )
    index, subindex, kind = TARGETS[mode]
    setpoint = [
        MappedEntry("controlword", CONTROLWORD, 0, "<u2"),
        MappedEntry("target", index, subindex, kind),
    ]
    return DriveStream(node, transmit, ProcessData(RPDO_1_BASE + node, SYNCHRONOUS, lay_out(setpoint)))
