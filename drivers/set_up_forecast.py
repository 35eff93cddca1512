"""What set-up will do to a drive, in words before anything is written: by what it holds and what its EDS lets be written.

Whether an object can be written shows only when it is. A drive's own EDS says it in advance; without one it is said what will
come of a refusal. An EDS may be wrong: what it says is no reason to refuse the drive.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drivers.fixed_mapping import OwnPdos, own_receive_pdo, own_transmit_pdos
from drivers.object_dictionary import own_dictionary
from drivers.process_data import MappedEntry, PdoParameters, WantedPdo
from drivers.profile import DriveProfile

_MAP_IT = "map it with the maker's tool"
Address = tuple[int, int]
"""index, subindex"""
_NOTICES_BY: dict[str, tuple[Address, ...]] = {
    "heartbeat": ((0x1016, 1),),
    "guarding": ((0x100C, 0), (0x100D, 0)),
}
"""objects by which a drive notices that we are gone"""


@dataclass(frozen=True)
class StatedAccess:
    """What a drive's own EDS says of writing; nothing where it has none."""

    file: str = ""
    writable: Mapping[Address, bool] = field(default_factory=dict[Address, bool])
    """of the objects that it lists"""

    @classmethod
    def of(cls, profile: DriveProfile, node: int, objects: Iterable[Address]) -> StatedAccess:
        """By the EDS that a profile names, of these objects; one that comes with the software is no drive's own."""
        dictionary = own_dictionary(profile.object_dictionary, node)
        if dictionary is None:
            return cls()
        variables: list[tuple[Address, Any]] = [(each, dictionary.get_variable(*each)) for each in objects]
        writable = {
            each: variable.access_type not in ("ro", "const")
            for each, variable in variables
            if variable is not None
        }
        return cls(Path(profile.object_dictionary).name, writable)

    def fixed(self, address: Address) -> bool:
        """Whether an object can only be read by what it says."""
        return self.writable.get(address) is False

    def may_refuse(self, address: Address) -> bool:
        """Whether a write may be refused: by the EDS, or because nothing says that it is not."""
        return not self.writable.get(address, False)

    def outcome(self, objects: Sequence[Address], comes_of_it: str) -> str:
        """What comes of it where some of these objects cannot be written; nothing where all of them can."""
        fixed = _listed([_named_object(each) for each in objects if self.fixed(each)])
        unknown = _listed([_named_object(each) for each in objects if each not in self.writable])
        by_file = f"by {self.file}, {fixed} can only be read" + ("" if unknown else f": {comes_of_it}")
        refusing = f"where it refuses {unknown}" + (", too" if fixed else "") + f", {comes_of_it}"
        return "; ".join([by_file] * bool(fixed) + [refusing] * bool(unknown))


def _named_object(address: Address) -> str:
    return f"0x{address[0]:04X}:{address[1]:02X}"


def objects_written(wanted: Sequence[WantedPdo], present: Sequence[PdoParameters]) -> list[Address]:
    """The objects that set-up may write: of the PDOs that are wanted, the COB-IDs of the others, cycle and heartbeat."""
    communications = {pdo.communication for pdo in (*present, *wanted)}
    written = [(index, subindex) for index in sorted(communications) for subindex in (1, 2)]
    mappings = [(pdo.mapping, subindex) for pdo in wanted for subindex in (0, 1)]
    return [
        *written,
        *mappings,
        (0x60C2, 1),
        (0x1006, 0),
        *_NOTICES_BY["heartbeat"],
        *_NOTICES_BY["guarding"],
    ]


def process_data_in_words(
    present: Sequence[PdoParameters], wanted: Sequence[WantedPdo], stated: StatedAccess
) -> list[str]:
    """Which PDOs are used as they stand, which set-up writes, and what comes of it where the drive refuses.

    present : as they were read; those that are wanted are among them
    """
    by_number = {(pdo.kind, pdo.number): pdo for pdo in present}
    pairs = [(pdo, by_number[pdo.kind, pdo.number]) for pdo in wanted]
    changed = [(pdo, now) for pdo, now in pairs if pdo.differs(now)]
    others = [
        pdo
        for pdo in present
        if pdo.valid and (pdo.kind, pdo.number) not in {(w.kind, w.number) for w in wanted}
    ]
    same = [f"{pdo.kind} {pdo.number} (0x{now.can_id:03X})" for pdo, now in pairs if not pdo.differs(now)]
    sentences = [f"has {_listed(same)} as needed already: nothing is written there"] if same else []
    tasks = [f"{pdo.kind} {pdo.number} ({_change(pdo, now)})" for pdo, now in changed]
    does = [f"write {_listed(tasks)}"] if tasks else []
    does += [f"switch off {_listed([f'{each.kind} {each.number}' for each in others])}"] if others else []
    outcomes = _outcomes(present, wanted, changed, others, stated)
    if does:
        can = f"; by {stated.file}, all of it can be written" if stated.file and not outcomes else ""
        sentences += [f"set-up is to {' and '.join(does)}{can}", *outcomes]
    return sentences


def _outcomes(
    present: Sequence[PdoParameters],
    wanted: Sequence[WantedPdo],
    changed: Sequence[tuple[WantedPdo, PdoParameters]],
    others: Sequence[PdoParameters],
    stated: StatedAccess,
) -> list[str]:
    """What comes of refusals: of COB-IDs, of mappings by direction, of transmission types."""
    on = [(pdo, now) for pdo, now in changed if now.valid]
    off = [pdo for pdo, now in changed if not now.valid]
    fixed_ids = [
        f"0x{now.can_id:03X}"
        for pdo, now in on
        if stated.may_refuse((pdo.communication, 1)) and pdo.readdressed(now)
    ]
    said = [
        stated.outcome(
            [(pdo.communication, 1) for pdo, now in on if pdo.readdressed(now)],
            f"it goes on with {_listed(fixed_ids)}",
        ),
        stated.outcome(
            [(pdo.communication, 1) for pdo in off],
            f"{_listed([f'{pdo.kind} {pdo.number}' for pdo in off])} stays off, and the session is refused; switch it on with "
            "the maker's tool",
        ),
    ]
    for kind in ("TPDO", "RPDO"):
        remapped = [pdo for pdo, now in changed if pdo.kind == kind and pdo.remapped(now)]
        entries = [entry for pdo in wanted if pdo.kind == kind for entry in pdo.entries]
        if remapped:
            serving = (
                own_transmit_pdos(present, entries) if kind == "TPDO" else own_receive_pdo(present, entries)
            )
            said.append(stated.outcome(_mapping_objects(remapped, stated), _as_they_stand(serving)))
    for kind, what in (
        (
            "TPDO",
            "it does not go with SYNC, and the session is refused; set transmission type 1 with the maker's tool",
        ),
        ("RPDO", "setpoints are taken as its transmission type says"),
    ):
        retimed = [(pdo.communication, 2) for pdo, now in changed if pdo.kind == kind and pdo.retimed(now)]
        said.append(stated.outcome(retimed, what) if stated.file or kind == "TPDO" else "")
    stays = [pdo.communication for pdo in others]
    said.append(
        stated.outcome([(index, 1) for index in stays], "what cannot be switched off stays on beside them")
    )
    return [each for each in said if each]


def _mapping_objects(remapped: Sequence[WantedPdo], stated: StatedAccess) -> list[Address]:
    """The objects of mappings that may refuse; the number of entries stands for all of them where it does."""
    return [(pdo.mapping, 0) if stated.may_refuse((pdo.mapping, 0)) else (pdo.mapping, 1) for pdo in remapped]


def _as_they_stand(serving: OwnPdos) -> str:
    if serving.lacking:
        return f"the session is refused, for it has no {serving.lacking}; {_MAP_IT}"
    named = [
        f"{pdo.kind} {pdo.number} (0x{pdo.can_id:03X}: {', '.join(_named(entry) for entry in entries)})"
        for pdo, entries in serving.pdos
    ]
    return f"it is driven by its PDOs as they stand: {_listed(named)}"


def _named(entry: MappedEntry) -> str:
    return entry.name if entry.name != "other" else f"0x{entry.index:04X}"


def _change(pdo: WantedPdo, now: PdoParameters) -> str:
    changes = (
        [f"COB-ID 0x{now.can_id:03X}{'' if now.valid else ', off,'} to 0x{pdo.can_id:03X}"]
        if pdo.readdressed(now)
        else []
    )
    changes += ["mapping"] if pdo.remapped(now) else []
    changes += (
        [f"transmission type {now.transmission_type} to {pdo.transmission_type}"] if pdo.retimed(now) else []
    )
    return ", ".join(changes)


def cycle_in_words(
    holds: float | None, communication: int | None, cycle: float, stated: StatedAccess
) -> list[str]:
    """How the drive is given the time between two setpoints.

    holds         : s in 0x60C2; None where the drive does not have it
    communication : µs in 0x1006; likewise
    cycle         : s
    """
    sentences: list[str] = []
    wanted = round(cycle * 1e6)
    has_cycle = holds is not None and round(holds * 1e6) == wanted
    if has_cycle:
        sentences.append(
            f"its interpolation time (0x60C2) is the rig's cycle, {cycle:g} s, already: nothing is written there"
        )
    elif holds is not None:
        refused = stated.outcome([(0x60C2, 1)], f"the session is refused; give the rig the cycle {holds:g} s")
        sentences.append(
            "; ".join(
                filter(
                    None,
                    (
                        f"set-up is to write its interpolation time (0x60C2), {holds:g} s to {cycle:g} s",
                        refused,
                    ),
                )
            )
        )
    if communication is not None and communication != wanted and stated.fixed((0x1006, 0)):
        kept = (
            "it keeps it, and has the cycle by 0x60C2"
            if holds is not None
            else "the session is refused; give the rig that cycle"
        )
        sentences.append(
            f"its communication cycle (0x1006) is {communication} µs; {stated.outcome([(0x1006, 0)], kept)}"
        )
    return sentences


def master_watch_in_words(by: str, stated: StatedAccess) -> list[str]:
    """Whether the drive can be told to notice when we are gone; `by` as in `ManagedNode.misses_master_by`."""
    refused = stated.outcome(_NOTICES_BY.get(by, ()), "it may not notice when we are gone")
    return [f"set-up is to tell it to notice when we are gone; {refused}"] if refused else []


def _listed(items: Sequence[str]) -> str:
    return ", ".join(items[:-1]) + (" and " if len(items) > 1 else "") + items[-1] if items else ""
