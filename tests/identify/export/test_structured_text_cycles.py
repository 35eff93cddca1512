"""What the function block keeps from call to call."""

from __future__ import annotations

import numpy as np
import pytest

from identify.export.iec61131.function_block import FunctionBlock
from tests.identify.export.derivatives import PERIOD, sine


def test_the_block_begins_anew_where_it_is_told_to(with_derivatives, all_formats):
    folder, formats = all_formats
    motion = sine(with_derivatives["all"].experiment.payloads[0], np.arange(40) * PERIOD)
    twice = {
        name: np.vstack([values, values])
        for name, values in (
            ("Q", motion.q),
            ("DQ", motion.dq),
            ("DDQ", motion.ddq),
            ("T", motion.t[:, None]),
        )
    }
    twice["PERIOD"] = np.full((80, 1), PERIOD)
    twice["RESET"] = np.arange(80)[:, None] == 40
    block = FunctionBlock((folder / "arm.st").read_text(), "arm.st")
    torque = block.call(twice, "TORQUE")
    assert torque[40:] == pytest.approx(torque[:40], rel=1e-9, abs=1e-9)
    assert torque[3:39] == pytest.approx(formats["formulas"](motion)[:36], rel=1e-9, abs=1e-9)
