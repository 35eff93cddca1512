"""An exported structured text, read and run by `identify.export.iec61131`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.payload import payload_parameters
from identify.export.iec61131.function_block import FunctionBlock
from identify.export.record_error import Motion, TorqueOf

Array = NDArray[np.float64]


def structured_text_torque(path: Path) -> TorqueOf:
    """What the function block of a file returns, called once for each row; a new one for each motion.

    Raises InputError: with file and line, where the text is not structured text.
    """
    text = path.read_text(encoding="utf-8")

    def torque_of(motion: Motion) -> Array:
        rows = len(motion.q)
        inputs = {
            "Q": motion.q,
            "DQ": motion.dq,
            "DDQ": motion.ddq,
            "T": motion.t[:, None],
            "PAYLOAD": np.broadcast_to(payload_parameters(motion.payload), (rows, 10)),
        }
        if motion.temperature is not None:
            inputs["TEMP"] = motion.temperature
        return FunctionBlock(text, path.name).call(inputs, "TORQUE")

    return torque_of
