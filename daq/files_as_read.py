"""The files that a session is made from, as they were when they were read: whether one of them is another by now.

An operator checks a rig and starts what was checked. Limits, scales and mappings come from files that somebody may change in
between, and other processes of the session read some of them again.
"""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Self

from daq.rig import Rig, rig_file
from drivers.profile import profile_files


@dataclass(frozen=True)
class FilesAsRead:
    """Digest of the content of each file; None of one that could not be read."""

    digests: Mapping[Path, str | None] = field(default_factory=lambda: MappingProxyType({}))

    @classmethod
    def of(cls, files: Iterable[Path]) -> Self:
        """As they are now; taken before they are read, so that a change meanwhile counts as one."""
        return cls({file: _digest(file) for file in files})

    def __or__(self, other: "FilesAsRead") -> "FilesAsRead":
        return FilesAsRead({**self.digests, **other.digests})

    def change(self) -> str:
        """Which files are others by now, in words such as `arm.yaml was changed`; empty where none is."""
        changed = [
            f"{file} was {'changed' if now is not None else 'removed'}"
            for file, before in self.digests.items()
            if (now := _digest(file)) != before
        ]
        return " and ".join(changed)


def rig_as_read(source: str | Path) -> tuple[Rig, FilesAsRead]:
    """A rig by its file or its name, with the files that it is made from: its own, and profiles and EDS files of its drives.

    Raises InputError as `Rig.load`.
    """
    rig_alone = FilesAsRead.of([rig_file(source)])
    rig = Rig.load(source)
    return rig, rig_alone | FilesAsRead.of(file for axis in rig.axes for file in profile_files(axis.drive))


def drive_digests(rig: Rig) -> tuple[str, ...]:
    """(n,) of what each axis's drive profile says and of its object dictionary, to be compared at another time; alike where only
    comments of a profile differ."""
    digests: list[str] = []
    for axis, profile in zip(rig.axes, rig.profiles, strict=True):
        digest = hashlib.sha256(profile.model_dump_json(exclude={"object_dictionary"}).encode())
        digest.update((_digest(profile_files(axis.drive)[-1]) or "").encode())
        digests.append(digest.hexdigest())
    return tuple(digests)


def changed_drive(rig: Rig, before: Sequence[str | None]) -> str:
    """Which drive's profile or object dictionary is another by now, in words such as `drive of j3: own.yaml or own.eds`; empty
    where none is.

    before : (n,) what `drive_digests` gave; None for an axis that is not compared
    """
    for axis, then, now in zip(rig.axes, before, drive_digests(rig), strict=True):
        if then is not None and now != then:
            files = " or ".join(file.name for file in profile_files(axis.drive))
            return f"drive of {axis.joint}: {files}"
    return ""


def _digest(file: Path) -> str | None:
    try:
        return hashlib.sha256(file.read_bytes()).hexdigest()
    except OSError:
        return None
