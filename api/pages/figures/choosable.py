"""What a page's script must know of a figure so that samples can be chosen in it, and those chosen elsewhere are shown."""

import json
from collections.abc import Mapping
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
    """Both axes of a figure in which samples can be chosen, or those chosen elsewhere are shown."""

    across: Axis
    up: Axis

    def axes_json(self, x: Scale, y: Scale) -> str:
        """As JSON: of each axis its column, its ends (in the column's unit), where those are (user units of the figure),
        and its edges."""
        return json.dumps({"x": _told(self.across, x), "y": _told(self.up, y)}, separators=(",", ":"))


def groups_json(x: Scale, rows: Mapping[str, float]) -> str:
    """As JSON, of bars that lie in rows: the scale along them, and where in each group's row the chosen samples are drawn
    (`rows`: group -> upper edge, user units of the figure)."""
    groups = {
        "ends": [float(f"{end:.6g}") for end in (x.low, x.high)],
        "at": [round(x.start, 2), round(x.end, 2)],
        "rows": {name: round(place, 2) for name, place in rows.items()},
    }
    return json.dumps(groups, separators=(",", ":"))


def _told(axis: Axis, scale: Scale) -> dict[str, str | list[float] | None]:
    return {
        "column": axis.column,
        "ends": [float(f"{end:.6g}") for end in (scale.low, scale.high)],
        "at": [round(scale.start, 2), round(scale.end, 2)],
        "edges": [float(f"{edge:.6g}") for edge in axis.edges],
    }
