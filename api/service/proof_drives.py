"""The two drives of a proof among the sessions of the index: how they are told from others."""

from api.proof import FOLDER
from api.proof_drive import Drive
from api.service.database import SessionRow
from api.service.session_ids import DRIVE_ID


def drive_of_proof(row: SessionRow) -> tuple[str, Drive] | None:
    """The proof that a session is a drive of, and which; None for a session of the experiment itself."""
    match = DRIVE_ID.fullmatch(row.id)
    if match is None or (row.file is not None and not row.file.startswith(f"{FOLDER}/{match[1]}/")):
        return None  # of an index that was made before files were told from drives
    return match[1], "without" if match[2] == "without" else "with"
