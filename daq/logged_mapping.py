"""How the drives of a log of frames were mapped: in which frames, and where in them, the values of each axis stand.

By what tells it best: the rig file, the SDO traffic of the set-up in the log itself, the values that a DCF sets, our own mapping
(`standard_stream`), the defaults of an EDS. What the frames contradict is passed over.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from daq.can_log_reader import LoggedFrame
from daq.rig import Axis, Rig
from daq.rig_drives import MODES
from drivers.cia402 import State
from drivers.fixed_mapping import own_receive_pdo, own_transmit_pdos
from drivers.frames import ERROR, REMOTE
from drivers.object_dictionary import own_dictionary
from drivers.process_data import DriveStream, MappedEntry, PdoParameters, ProcessData, pdo_objects
from drivers.profile import DriveProfile
from drivers.standard_stream import RPDO_1_BASE, TPDO_BASE, standard_stream, transmitted_entries
from drivers.sync_producer import SYNC_ID
from identify.recording.errors import InputError

_SYNC_COB_ID = (0x1005, 0)
_PDOS = 32
"""of each direction that are looked for; a drive has up to 512, and hardly one uses the ninth"""
_MOST_ENTRIES = 8
_NMT, _START = 0, 1
_TO_DRIVE, _FROM_DRIVE = 0x600, 0x580
_ENABLED_FRAMES = 16
"""statuswords of an enabled drive that prove a mapping: in bytes that are none, this pattern is rare and does not last"""
_PROOF = 0.9
"""share of the frames of an id that must be as long as the mapping"""
_SHOWN = 12

Address = tuple[int, int]


@dataclass(frozen=True)
class LoggedMapping:
    """How the frames of all axes are read.

    streams : of the axes, in their order
    channel : of the log, on which they are
    sync_id : id of SYNC
    remarks : where this is known from, where it is not our own mapping
    """

    streams: tuple[DriveStream, ...]
    channel: str
    sync_id: int
    remarks: tuple[str, ...]


def mapping_of_log(path: Path, frames: Sequence[LoggedFrame], rig: Rig) -> LoggedMapping:
    """How the drives were mapped while a log was written.

    Raises InputError where nothing that tells it agrees with the frames; names what would.
    """
    by_channel: dict[str, list[LoggedFrame]] = {}
    for frame in frames:
        by_channel.setdefault(frame.channel, []).append(frame)
    # The channel that has most of the frames of drives first: what is said of a log is said of that one.
    nodes = {axis.node for axis in rig.axes}
    logs = sorted(map(_Log.of, by_channel.values()), key=lambda log: log.frames_of(nodes), reverse=True)
    for proved in (True, False):
        for log in logs:
            mapping = _mapping_of_channel(log, rig, proved)
            if isinstance(mapping, LoggedMapping):
                several = f"of its channels {log.channel}, which has most of the drives' process data"
                return replace(mapping, remarks=(several, *mapping.remarks)) if len(logs) > 1 else mapping
    missing = _mapping_of_channel(logs[0] if logs else _Log(), rig, False)
    raise InputError(f"{path}: {missing}")


def _mapping_of_channel(log: _Log, rig: Rig, proved: bool) -> LoggedMapping | str:
    """The mapping of all axes; what is missing, in words, where there is none.

    proved : whether the statuswords must be those of drives that are on
    """
    streams: list[DriveStream] = []
    remarks: list[str] = []
    sync_id = SYNC_ID
    for axis, profile in zip(rig.axes, rig.profiles, strict=True):
        said = log.objects.get(axis.node, {})
        listed = _listed_values(profile, axis.node)
        candidates = list(_candidates(rig, axis, profile, said, listed))
        for each in candidates:
            if each.stream and log.fits(each.stream) and (not proved or log.shows_enabled(each.stream)):
                streams.append(each.stream)
                ids = ", ".join(f"0x{can_id:X}" for can_id in each.stream.transmit_ids)
                remarks += (
                    [f"node {axis.node}: its process data ({ids}) by {each.source}"] if each.source else []
                )
                break
        else:
            return _nothing_tells(log, axis, candidates)
        stated = said.get(_SYNC_COB_ID, listed.set_by_dcf.get(_SYNC_COB_ID, SYNC_ID)) & 0x7FF
        sync_id = stated if stated in log.data else sync_id
    if sync_id != SYNC_ID:
        remarks.append(f"SYNC is 0x{sync_id:X} (object 0x1005)")
    return LoggedMapping(tuple(streams), log.channel, sync_id, tuple(remarks))


@dataclass(frozen=True)
class _Candidate:
    """A way in which a drive may have been mapped."""

    source: str
    """in words; nothing for our own mapping"""
    stream: DriveStream | None
    lacking: str = ""
    """why there is no stream"""


@dataclass
class _Log:
    """What of one channel of a log tells how its drives were mapped."""

    channel: str = ""
    data: dict[int, list[bytes]] = field(default_factory=dict[int, list[bytes]])
    """by id, of plain frames with short ids"""
    objects: dict[int, dict[Address, int]] = field(default_factory=dict[int, dict[Address, int]])
    """by node: what objects held when the drive was last started (NMT), or in the end"""

    @classmethod
    def of(cls, frames: Iterable[LoggedFrame]) -> _Log:
        log = cls()
        asked: dict[int, bytes] = {}
        started: dict[int, dict[Address, int]] = {}
        for frame in frames:
            log.channel = frame.channel
            if frame.extended or frame.flags & (ERROR | REMOTE):
                continue
            log.data.setdefault(frame.can_id, []).append(frame.data)
            node, service = frame.can_id & 0x7F, frame.can_id & ~0x7F
            if service == _TO_DRIVE:
                asked[node] = frame.data
            elif service == _FROM_DRIVE and node in asked:
                answer = _value_said(asked.pop(node), frame.data)
                if answer is not None:
                    log.objects.setdefault(node, {})[answer[0]] = answer[1]
            elif frame.can_id == _NMT and frame.data[:1] == bytes((_START,)) and len(frame.data) > 1:
                addressed = log.objects if not frame.data[1] else {frame.data[1]}
                started.update({each: dict(log.objects[each]) for each in addressed if each in log.objects})
        for node, objects in started.items():
            log.objects[node] = log.objects[node] | objects
        return log

    @property
    def lengths(self) -> dict[int, int]:
        """By id, the length that most of its frames have."""
        return {can_id: _most([len(each) for each in data]) for can_id, data in self.data.items()}

    def frames_of(self, nodes: set[int]) -> int:
        """How many frames of the predefined connection set are to or from these nodes."""
        return sum(
            len(data) for can_id, data in self.data.items() if can_id > 0x80 and can_id & 0x7F in nodes
        )

    def fits(self, stream: DriveStream) -> bool:
        """Whether the frames are there, and as long as they must be."""
        return all(
            sum(len(each) >= pdo.length for each in self.data.get(pdo.can_id, ()))
            >= max(1.0, _PROOF * len(self.data.get(pdo.can_id, ())))
            for pdo in stream.transmit
        )

    def shows_enabled(self, stream: DriveStream) -> bool:
        """Whether the statuswords in frames that fit are those of a drive that is on for a while."""
        pdo, entry = stream.find("statusword")
        mask, enabled = State.OPERATION_ENABLED.value
        place = slice(entry.byte_offset, entry.byte_offset + 2)
        on = (int.from_bytes(each[place], "little") & mask == enabled for each in self.data[pdo.can_id])
        return sum(on) >= _ENABLED_FRAMES


def _most(lengths: list[int]) -> int:
    return max(set(lengths), key=lengths.count)


def _value_said(request: bytes, response: bytes) -> tuple[Address, int] | None:
    """The object and its value by an expedited transfer that succeeded (CiA 301, section 7.2.4.3.3); None for any other."""
    if len(request) < 8 or len(response) < 8 or request[1:4] != response[1:4]:
        return None
    if request[0] & 0xE2 == 0x22 and response[0] & 0xE0 == 0x60:
        command, value = request[0], request[4:8]
    elif request[0] & 0xE0 == 0x40 and response[0] & 0xE2 == 0x42:
        command, value = response[0], response[4:8]
    else:
        return None
    size = 4 - (command >> 2 & 3) if command & 1 else 4
    return (int.from_bytes(request[1:3], "little"), request[3]), int.from_bytes(value[:size], "little")


@dataclass(frozen=True)
class _ListedValues:
    """What an EDS or DCF says that objects hold."""

    set_by_dcf: dict[Address, int] = field(default_factory=dict[Address, int])
    """ParameterValue"""
    defaults: dict[Address, int] = field(default_factory=dict[Address, int])
    """those and, of the others, DefaultValue"""

    def configured(self, address: Address) -> int | None:
        """The value that a DCF sets."""
        return self.set_by_dcf.get(address)


def _listed_values(profile: DriveProfile, node: int) -> _ListedValues:
    dictionary = own_dictionary(profile.object_dictionary, node)
    listed = _ListedValues()
    for address in _pdo_objects() if dictionary is not None else ():
        variable = dictionary.get_variable(*address) if dictionary is not None else None
        if variable is None:
            continue
        value = getattr(variable, "value", None)
        if isinstance(value, int):
            listed.set_by_dcf[address] = value
        if value is None:
            value = variable.default
        if isinstance(value, int):
            listed.defaults[address] = value
    return listed


def _pdo_objects() -> Iterator[Address]:
    yield _SYNC_COB_ID
    for number in range(1, _PDOS + 1):
        for kind in ("TPDO", "RPDO"):
            communication, mapping = pdo_objects(kind, number)
            yield communication, 1
            yield communication, 2
            yield from ((mapping, subindex) for subindex in range(_MOST_ENTRIES + 1))


def _candidates(
    rig: Rig, axis: Axis, profile: DriveProfile, said: dict[Address, int], listed: _ListedValues
) -> Iterator[_Candidate]:
    """Ways in which a drive may have been mapped, what tells most of it first."""
    ours = standard_stream(axis.node, profile, MODES[axis.mode], rig.record_temperature)
    wanted = transmitted_entries(profile, rig.record_temperature)
    target = ours.receive.entry("target")

    def by(source: str, pdos: list[PdoParameters]) -> _Candidate:
        sends = own_transmit_pdos(pdos, wanted)
        if sends.lacking:
            return _Candidate(source, None, f"by {source}, it has no {sends.lacking}")
        takes = own_receive_pdo(pdos, [target])
        receive = ours.receive if takes.lacking else _process_data(*takes.pdos[0])
        return _Candidate(
            source, DriveStream(axis.node, tuple(_process_data(*each) for each in sends.pdos), receive)
        )

    if axis.logged_pdos:
        yield by("the rig file", list(_stated_pdos(axis)))
    if any(index & 0xFE00 in (0x1400, 0x1600, 0x1800, 0x1A00) for index, _ in said):
        yield by("the SDO traffic in the log", _pdos(axis.node, listed.defaults | said))
    named = Path(profile.object_dictionary).name
    if any(index >= 0x1400 for index, _ in listed.set_by_dcf):
        yield by(f"the values of {named}", _pdos(axis.node, listed.defaults))
    yield _Candidate("", ours)
    if listed.defaults:
        yield by(f"the defaults of {named}", _pdos(axis.node, listed.defaults))


def _process_data(pdo: PdoParameters, entries: tuple[MappedEntry, ...]) -> ProcessData:
    return ProcessData(pdo.can_id, pdo.transmission_type, entries)


def _stated_pdos(axis: Axis) -> Iterator[PdoParameters]:
    """The PDOs of a rig file, which does not say their direction: what carries a target comes to the drive."""
    for number, (can_id, mapping) in enumerate((axis.logged_pdos or {}).items(), 1):
        for kind in ("TPDO", "RPDO"):
            yield PdoParameters(kind, number, can_id, 1, tuple(mapping))


def _pdos(node: int, values: dict[Address, int]) -> list[PdoParameters]:
    """The PDOs that objects make; a COB-ID that nothing tells is that of the predefined connection set."""
    pdos: list[PdoParameters] = []
    for kind, bases in (
        ("TPDO", TPDO_BASE),
        ("RPDO", tuple(base + RPDO_1_BASE - TPDO_BASE[0] for base in TPDO_BASE)),
    ):
        for number in range(1, _PDOS + 1):
            communication, mapping = pdo_objects(kind, number)
            cob_id = values.get(
                (communication, 1), bases[number - 1] + node if number <= len(bases) else None
            )
            count = values.get((mapping, 0), 0)
            entries = [values.get((mapping, place)) for place in range(1, min(count, _MOST_ENTRIES) + 1)]
            if cob_id is not None and entries and None not in entries:
                whole = tuple(entry for entry in entries if entry is not None)
                pdos.append(PdoParameters(kind, number, cob_id, values.get((communication, 2), 1), whole))
    return pdos


def _nothing_tells(log: _Log, axis: Axis, candidates: Sequence[_Candidate]) -> str:
    """What is said where no mapping agrees with the frames, with what would tell it."""
    ours = next(each.stream for each in candidates if not each.source)
    assert ours is not None  # our own mapping is always one
    wrong = next((pdo for pdo in ours.transmit if pdo.can_id not in log.data), None)
    carried = ", ".join(entry.name for pdo in ours.transmit for entry in pdo.entries)
    what = (
        f"holds no frame 0x{wrong.can_id:X} of node {axis.node} ({', '.join(entry.name for entry in wrong.entries)})"
        if wrong
        else f"the frames of node {axis.node} are too short for {carried}"
    )
    lengths = log.lengths
    shown = [f"0x{can_id:X} ({lengths[can_id]} bytes)" for can_id in sorted(lengths)]
    there = ", ".join(shown[:_SHOWN]) + (" ..." if len(shown) > _SHOWN else "")
    lacking = "".join(f"; {each.lacking}" for each in candidates if each.lacking)
    return (
        f"{what}{lacking}; there are {there or 'no frames'}. Is the node in the rig file right? Of a drive that was not mapped"
        " by us, log the set-up too, name the drive's DCF as axes[].drive, or state axes[].logged_pdos in the rig file"
    )
