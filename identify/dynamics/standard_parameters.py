"""The standard inertial parameters of a serial robot: names, units, order (paper, section II.B)."""

from __future__ import annotations

from identify.dynamics.geometry import Geometry

LINK_PARAMETERS = ("XX", "XY", "XZ", "YY", "YZ", "ZZ", "MX", "MY", "MZ", "M")
"""Ten parameters of a rigid link, in the order of the regressor's columns.

XX .. ZZ are the elements of the inertia tensor about the frame's origin O_j (not about the centre of mass),
MX MY MZ the first moments about O_j, both in the link's frame (Khalil's convention)."""

STANDARD_PARAMETERS = (*LINK_PARAMETERS, "Ia")
"""The same and Ia, the actuator's inertia referred to the joint: eleven per joint. Friction and offset are
effects."""

PARAMETERS_PER_JOINT = len(STANDARD_PARAMETERS)
ROTOR_INERTIA = STANDARD_PARAMETERS.index("Ia")


def standard_names(geometry: Geometry) -> tuple[str, ...]:
    """Names of the 11 n standard parameters: XX1 .. M1, Ia1, XX2 .. Ian."""
    return tuple(
        f"{symbol}{joint + 1}" for joint in range(geometry.joint_count) for symbol in STANDARD_PARAMETERS
    )


def standard_units(geometry: Geometry) -> tuple[str, ...]:
    """Units of the 11 n standard parameters; Ia of a prismatic joint is a mass."""
    units = []
    for prismatic in geometry.prismatic:
        units += ["kg m^2"] * 6 + ["kg m"] * 3 + ["kg", "kg" if prismatic else "kg m^2"]
    return tuple(units)
