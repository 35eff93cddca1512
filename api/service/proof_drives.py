"""The two drives of a proof among the sessions of the index: how they are called, and how they are told from others."""

import re
from typing import Literal

from api.proof import FOLDER
from api.service.database import SessionRow

Drive = Literal["without", "with"]
"""of the plan: without torque sent ahead, then with it"""

_DRIVE_ID = re.compile(r"proof-(\d{2,})-(without|with)")


def drive_id(proof: str, drive: Drive) -> str:
    """The id of the session that is one of a proof's drives."""
    return f"proof-{proof}-{drive}"


def drive_of_proof(row: SessionRow) -> tuple[str, Drive] | None:
    """The proof that a session is a drive of, and which; None for a session of the experiment itself.

    A file that somebody called like a drive and uploaded is none: drives are recorded into their proof's folder.
    """
    match = _DRIVE_ID.fullmatch(row.id)
    if match is None or (row.file is not None and not row.file.startswith(f"{FOLDER}/{match[1]}/")):
        return None
    return match[1], "without" if match[2] == "without" else "with"
