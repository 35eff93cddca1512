"""How sessions are called in the index: measured ones after their files, drives of proofs after their proof."""

import re

from api.proof_drive import Drive

DRIVE_ID = re.compile(r"proof-(\d{2,})-(without|with)")
_LIKE_A_DRIVE = re.compile(rf"(?:file-)*{DRIVE_ID.pattern}")


def drive_id(proof: str, drive: Drive) -> str:
    """The id of the session that is one of a proof's drives."""
    return f"proof-{proof}-{drive}"


def session_id(file: str) -> str:
    """The id of a measured session: its file's name without the ending; a file that is called like a drive gets another."""
    name = re.sub(r"(\.csv\.gz|\.csv|\.h5|\.hdf5)$", "", file)
    return f"file-{name}" if _LIKE_A_DRIVE.fullmatch(name) else name
