"""Measured and predicted torque of a model, as files that a plot reads in parts (memory-mapped)."""

import secrets
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.lib.format import open_memmap

from api.service.stored_samples import COLUMNS, StoredSamples
from api.service.torque_outline import outline


def prediction_file(folder: Path, session: int, joint: int) -> Path:
    """The file of one session and joint, both counted from 0 in the experiment's order."""
    return folder / f"prediction-{session}-{joint}.npy"


def write_prediction(folder: Path, session: int, joint: int, prediction) -> None:
    """Write the arrays of a `Prediction` (time, position, …, each (M,)) as one float64 array (9, M), and its outline."""
    nothing = np.full(len(prediction.time), np.nan)
    columns = {name: getattr(prediction, name) for name in COLUMNS}
    arrays = [np.asarray(nothing if each is None else each, dtype=float) for each in columns.values()]
    stored = open_memmap(
        prediction_file(folder, session, joint),
        mode="w+",
        dtype=np.float64,
        shape=(len(arrays), len(arrays[0])),
    )
    for row, values in enumerate(arrays):
        stored[row] = values
    stored.flush()
    np.save(outline_file(folder, session, joint), outline(StoredSamples(*arrays)))


def outline_file(folder: Path, session: int, joint: int) -> Path:
    """The file of the outline of one session and joint, beside that of its samples."""
    return folder / f"outline-{session}-{joint}.npy"


def read_outline(folder: Path, session: int, joint: int) -> np.ndarray | None:
    """(11, blocks) as `torque_outline` describes it; made now for a fit that was stored without one, and kept where it can
    be. None where there are no samples either."""
    file = outline_file(folder, session, joint)
    try:
        return np.load(file)
    except FileNotFoundError:
        part = read_prediction(folder, session, joint)
        if part is None:
            return None
        made = outline(part)
        with suppress(OSError):  # a full disk, a folder that is only read
            unfinished = file.with_name(f".{secrets.token_hex(4)}.npy")
            np.save(unfinished, made)
            unfinished.replace(file)
        return made


def read_prediction(folder: Path, session: int, joint: int) -> StoredSamples | None:
    """Views of the mapped file; None if there is none."""
    try:
        stored = np.load(prediction_file(folder, session, joint), mmap_mode="r")
    except FileNotFoundError:
        return None
    return StoredSamples(*stored)


def candidate_file(folder: Path, session: int, joint: int, rank: int) -> Path:
    """The file of the torque predicted with one candidate more: the candidate of that rank in the diagnosis."""
    return folder / f"with-{session}-{joint}-{rank}.npy"


def write_candidate(folder: Path, session: int, joint: int, rank: int, predicted: np.ndarray) -> None:
    """Write the torque (M,) that the model would predict with that candidate; single precision is enough to draw it."""
    np.save(candidate_file(folder, session, joint, rank), np.asarray(predicted, dtype=np.float32))


def read_candidate(folder: Path, session: int, joint: int, rank: int) -> np.ndarray | None:
    """(M,) as written; None if there is none."""
    try:
        return np.load(candidate_file(folder, session, joint, rank), mmap_mode="r")
    except FileNotFoundError:
        return None
