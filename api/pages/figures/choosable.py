"""What a page's script must know of a figure so that samples can be chosen in it, and those chosen elsewhere are shown."""

import json
from dataclasses import dataclass

import numpy as np

from api.pages.figures.drawing import Scale


@dataclass(frozen=True)
class Axis:
    """What an axis of a figure is of.

    column : name of the samples' column; None where it is of something else, a share for example
    edges  : (cells + 1,) what a choice along the axis goes from and to; empty where none is made along it
    """

    column: str | None
    edges: np.ndarray | tuple[float, ...] = ()


@dataclass(frozen=True)
class Choosable:
    """Both axes of a figure in which samples can be chosen."""

    across: Axis
    up: Axis

    def axes_json(self, x: Scale, y: Scale) -> str:
        """As JSON: of each axis its column, its ends (in the column's unit), where those are (user units of the figure),
        and its edges."""
        return json.dumps({"x": _told(self.across, x), "y": _told(self.up, y)}, separators=(",", ":"))


def _told(axis: Axis, scale: Scale) -> dict[str, str | list[float] | None]:
    return {
        "column": axis.column,
        "ends": [float(f"{end:.6g}") for end in (scale.low, scale.high)],
        "at": [round(scale.start, 2), round(scale.end, 2)],
        "edges": [float(f"{edge:.6g}") for edge in axis.edges],
    }
