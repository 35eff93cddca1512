"""Stored experiments by name: what every command's EXPERIMENT may be."""

import re
from pathlib import Path

from api.data_folder import default_data_folder
from identify.recording.errors import InputError

EXPERIMENT_ID = re.compile(r"[a-z0-9][a-z0-9_.-]{0,63}")
"""What the folder of a stored experiment may be called; this is also its id in the service."""


def resolve(name_or_path: str | Path, data_folder: Path | None = None) -> Path:
    """The folder or file of an experiment given as a path or as the name of a stored one.

    data_folder : where stored experiments are; None is `COULOMB_DATA` or the user's own data folder

    Raises InputError if it is neither, with the names that are stored.
    """
    given = Path(name_or_path)
    if given.exists():
        return given
    stored = (data_folder or default_data_folder()) / "experiments"
    if EXPERIMENT_ID.fullmatch(str(name_or_path)) and (stored / given / "experiment.yaml").is_file():
        return stored / given
    names = sorted(file.parent.name for file in stored.glob("*/experiment.yaml"))
    known = f"stored are: {', '.join(names)}" if names else f"nothing is stored in {stored} yet"
    raise InputError(f"{name_or_path}: no such folder, experiment.yaml or stored experiment; {known}")
