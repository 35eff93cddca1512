"""Where the windows of a simulation begin."""

import numpy as np


def window_starts(available: int, samples: int, most: int) -> list[int]:
    """First rows of windows, one behind the other all along the record, evenly thinned where there are more than `most`."""
    starts = np.arange(0, available - samples + 1, max(1, samples - 1))
    if len(starts) > most:
        starts = starts[np.linspace(0, len(starts) - 1, most).round().astype(int)]
    return [int(start) for start in starts]
