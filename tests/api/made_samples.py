"""Stored samples as a test needs them: the columns that it says, zeros in all others."""

import numpy as np

from api.service.stored_samples import COLUMNS, StoredSamples


def made_samples(time: np.ndarray, **columns: np.ndarray) -> StoredSamples:
    """(M,) each, at `time`."""
    return StoredSamples(
        **{name: columns.get(name, np.zeros(len(time))) for name in COLUMNS if name != "time"}, time=time
    )
