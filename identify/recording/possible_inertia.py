"""Inertias that a body can have."""

from __future__ import annotations

import numpy as np

Six = tuple[float, float, float, float, float, float]

ROUNDED = 1e-3
"""Of the largest moment: what was rounded for a data sheet may be below zero by so much."""


def check_inertia(inertia: Six) -> Six:
    """The same XX XY XZ YY YZ ZZ, kg m². Raises ValueError: they are negative about some axis.

    That no moment exceeds the sum of the two others is not asked: of a robot of one joint, one moment is all that anybody states.
    """
    xx, xy, xz, yy, yz, zz = inertia
    moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if moments[0] < -ROUNDED * max(float(moments[-1]), 0.0):
        raise ValueError(
            "is negative about some axis, as of no body; give XX, XY, XZ, YY, YZ, ZZ about the centre of mass"
        )
    return inertia
