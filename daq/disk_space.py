"""How much room a session needs on the disk, asked before anything moves."""

import shutil
from pathlib import Path

from daq.rig import Rig
from daq.samples import sample_dtype
from identify.recording.errors import InputError

_LOG_LINE = 45
"""bytes of a frame in the raw log: "(1700000000.000000) can0 183#0011223344556677" and its line end"""
_FRAMES_PER_AXIS = 2
"""a TPDO, and a second one where the mapping does not fit into the first"""
_BEFORE_AND_AFTER = 60.0
"""s of frames beside the plan's: standing armed, approach, settling, stop"""


def needed_megabytes(rig: Rig, seconds: float) -> float:
    """MB for a session of `seconds` s of plan: samples, and the raw log of SYNC and TPDOs."""
    n = len(rig.axes)
    rows = seconds / rig.cycle
    cycles = (seconds + _BEFORE_AND_AFTER) / rig.cycle
    frames = cycles * (1 + _FRAMES_PER_AXIS * n)
    return (rows * sample_dtype(n).itemsize + frames * _LOG_LINE) / 1e6


def require_space(rig: Rig, folder: Path, seconds: float) -> None:
    """Raise InputError when the disk under `folder` has less free than the session needs beside the reserve."""
    free = shutil.disk_usage(folder).free / 1e6
    needed, reserve = needed_megabytes(rig, seconds), rig.storage.disk_reserve
    if free < needed + reserve:
        raise InputError(
            f"{folder}: the disk has {free:.0f} MB free; a session of {seconds:.0f} s needs {needed:.0f} MB, and "
            f"{reserve:g} MB must stay in reserve (storage.disk_reserve)"
        )
