"""The drive gain of eq. (4): joint torque per unit of the recorded command.

    g_f = N' G_i K_t,    tau = g_f v            eq. (4), eq. (7)

with N the gear ratios (motor velocities = N times joint velocities), G_i the gains of the current amplifiers
and K_t the torque constants. The paper writes N for diagonal ratios; with coupled axes power balance asks for
the transpose: tau' dq = tau_motor' N dq.
"""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

CommandUnit = Literal["A", "N m", "V", "rated current", "rated torque"]


SINGULAR = 1e-9
"""Smallest singular value, in parts of the rows' greatest entries, below which motors move alike."""


def is_singular(gear_ratio: NDArray[np.float64]) -> bool:
    """Whether the joints' velocities do not follow from the motors': (n, n) N of eq. (4).

    Judged by the directions of the rows: gears of very different ratios beside each other are no reason.
    """
    greatest = np.abs(gear_ratio).max(axis=1, keepdims=True)
    if not greatest.all():
        return True
    return bool(np.linalg.matrix_rank(gear_ratio / greatest, tol=SINGULAR) < len(gear_ratio))


def drive_gain(
    gear_ratio: ArrayLike,
    command_unit: CommandUnit,
    *,
    torque_constant: ArrayLike | None = None,
    amplifier_gain: ArrayLike | None = None,
    rated_current: ArrayLike | None = None,
    rated_torque: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """(n, n) joint torque per unit of command, N m (or N) per `command_unit`.

    gear_ratio      : (n,) motor turns per joint turn, or the (n, n) matrix N of coupled axes (rad/rad;
                      rad/m for
                      a prismatic joint)
    command_unit    : unit of the command v as recorded:
                      "A"             motor current; K_t needed
                      "V"             input of an analogue amplifier; G_i (A/V) and K_t needed
                      "N m"           motor torque; nothing more needed
                      "rated current" fraction of it; rated_current (A) and K_t needed
                      "rated torque"  fraction of it; rated_torque (N m) needed
    torque_constant : (n,) K_t, N m/A
    amplifier_gain  : (n,) G_i, A/V

    Raises ValueError when a quantity that the unit needs is missing, when one is given that has no place in
    it (a sign that the unit is not what was thought), or when shapes do not fit.
    """
    ratio = np.asarray(gear_ratio, float)
    if ratio.ndim == 0:
        ratio = ratio.reshape(1)
    if ratio.ndim == 1:
        ratio = np.diag(ratio)
    if ratio.ndim != 2 or len(set(ratio.shape)) != 1:
        raise ValueError(f"gear_ratio must be (n,) or (n, n), not {ratio.shape}")
    if is_singular(ratio):
        raise ValueError("gear_ratio is singular: some motor does not move, or two motors move alike")
    given = {
        "torque_constant (N m/A)": torque_constant,
        "amplifier_gain (A/V)": amplifier_gain,
        "rated_current (A)": rated_current,
        "rated_torque (N m)": rated_torque,
    }
    needed = {
        "A": ("torque_constant (N m/A)",),
        "V": ("torque_constant (N m/A)", "amplifier_gain (A/V)"),
        "N m": (),
        "rated current": ("torque_constant (N m/A)", "rated_current (A)"),
        "rated torque": ("rated_torque (N m)",),
    }.get(command_unit)
    if needed is None:
        raise ValueError(
            f"a command in {command_unit!r} is not known: A, V, N m, rated current, rated torque"
        )
    motor_torque = np.ones(len(ratio))
    for name, quantity in given.items():
        if (quantity is None) == (name in needed):
            problem = "needs" if quantity is None else "has no use for"
            raise ValueError(f"a command in {command_unit!r} {problem} {name}")
        if quantity is not None:
            values = np.asarray(quantity, float).reshape(-1)
            if values.size not in (1, len(ratio)):
                raise ValueError(f"{name} must have {len(ratio)} values, not {values.size}")
            if not np.all(np.isfinite(values) & (values != 0)):
                raise ValueError(f"{name} must be finite and not zero")
            motor_torque = motor_torque * values
    return ratio.T * motor_torque
