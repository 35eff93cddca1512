"""An exported structured text, read and run by `identify.export.iec61131`."""

from __future__ import annotations

import re
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

    waits = re.search(r"TORQUE : .*of the motion of (\d+) calls before", text)
    latency = int(waits[1]) if waits else 0

    def torque_of(asked: Motion) -> Array:
        motion = asked.continued(latency)
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
        if latency:
            inputs["PERIOD"] = np.diff(motion.t, prepend=motion.t[0])[:, None]
        return FunctionBlock(text, path.name).call(inputs, "TORQUE")[latency:]

    return torque_of
