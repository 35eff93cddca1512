"""A drive that does not take one object any more, at the place where its answers come in."""

import pytest

from drivers.drive import Drive
from drivers.errors import DriveError


def refuse_writes(monkeypatch: pytest.MonkeyPatch, drive: Drive, refused: int) -> None:
    """Let every writing of the object with index `refused` end as one that the drive refuses; all others go on."""
    whole = drive.sdo.write_bytes

    def refusing(index: int, subindex: int, data: bytes, what: str = "") -> None:
        if index == refused:
            raise DriveError(drive.node, what, index=index, received="the drive refused: read only")
        whole(index, subindex, data, what)

    monkeypatch.setattr(drive.sdo, "write_bytes", refusing)
