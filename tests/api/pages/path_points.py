"""Where a path of a figure goes."""

import re

import numpy as np


def points_of(data: str) -> np.ndarray:
    """(N, 2) points of path data: `M`, which begins somewhere, and `l`, ways from point to point."""
    points: list[tuple[float, float]] = []
    for command, numbers in re.findall(r"([Ml])([^MlZ]*)", data):
        values = [float(each) for each in re.findall(r"-?(?:\d+\.?\d*|\.\d+)", numbers)]
        for across, down in zip(values[::2], values[1::2], strict=True):
            x, y = (0.0, 0.0) if command == "M" else points[-1]
            points.append((x + across, y + down))
    return np.array(points).reshape(-1, 2)
