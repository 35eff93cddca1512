"""The whole matrix: `python -m tests.faults --write docs/faults.md`. Exit status 1 where a cell does not hold."""

import argparse
import logging
import sys
import time
from pathlib import Path

from tests.faults.matrix import FARTHEST, FAULTS, LONGEST, PHASES, Cell, cell

HEAD = f"""# Faults on the bus, and what became of the axis

Printed by `make faults`; not edited by hand. Every cell is a whole acquisition on the virtual bus in simulated time, with
the plant in view: RX130L joint 3 with its brake, which closes 50 ms after power is off. A fault begins in the phase that
the column names. Of every cell is asked: at the end the axis has no power and rests, in truth, or a person was told to press
the emergency stop; a fault that must stop the motion does, within {LONGEST:g} s and {FARTHEST:g} rad. A cell says what ended the
motion, whether power was cut, the way of the joint since the fault and for how long it still had power.

Killed processes, full disks, deleted files and clocks are in `tests/daq/test_kills.py`, `test_motion.py`,
`test_recovery.py` and `test_experiment_folder.py`; a real SocketCAN in `tests/vcan`.

"""


def main() -> int:
    """Drive the cells, print and write the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--write", type=Path)
    parser.add_argument("--only", default="", help="faults whose name holds this")
    arguments = parser.parse_args()
    logging.getLogger("canopen").setLevel(logging.CRITICAL)
    begun, cells = time.monotonic(), []
    lines = [f"| fault | {' | '.join(PHASES)} |", f"|---|{'---|' * len(PHASES)}"]
    for fault in FAULTS:
        if arguments.only not in fault.name:
            continue
        row: list[Cell] = [cell(fault, phase) for phase in PHASES]
        cells += row
        lines.append(f"| {fault.name} | {' | '.join(each.words for each in row)} |")
        print(lines[-1], flush=True)
    failed = [each for each in cells if each.failures]
    foot = f"\n{len(cells)} cells, {len(failed)} do not hold; {time.monotonic() - begun:.0f} s.\n"
    print(foot)
    if arguments.write is not None:
        arguments.write.write_text(HEAD + "\n".join(lines) + "\n" + foot, encoding="utf-8")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
