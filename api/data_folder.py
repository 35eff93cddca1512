"""Where experiments, rigs, plans and the service's database live when nobody says otherwise."""

import os
from pathlib import Path


def default_data_folder() -> Path:
    """The folder of `COULOMB_DATA`, else `coulomb` in the user's XDG data folder."""
    if chosen := os.environ.get("COULOMB_DATA"):
        return Path(chosen).expanduser()
    base = os.environ.get("XDG_DATA_HOME") or "~/.local/share"
    return Path(base).expanduser() / "coulomb"


STOP_SOCKET = "stop.socket"
"""Name in the data folder of the socket where `coulomb stop` comes in; nobody but the service's own user can open it."""
