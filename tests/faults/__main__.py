"""The whole matrix: `python -m tests.faults --write docs/faults.md`. Exit status 1 where a cell does not hold.

With `--kept FILE` every cell is kept as it ends, and one that is there already is not driven again.
"""

import argparse
import json
import logging
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from tests.faults.matrix import FARTHEST, FAULTS, LONGEST, PHASES, cell
from tests.faults.sessions import SESSION_FAULTS, SESSION_PHASES, session_cell

HEAD = """# Faults, and what became of the axis and of what was measured

Printed by `make faults`; not edited by hand.

"""
BENCH = f"""## On the bus, in processes and clocks: the axis

Every cell is a whole acquisition on the virtual bus, with the plant in view: RX130L joint 3 with its brake, which closes 50 ms
after power is off; in simulated time but for the rows *bus stands still*. A fault begins in the phase that the column names:
before the rig is checked, after that, armed and without power (*streaming*), with power, in slow and in fast motion, while an
operator's stop brakes. Of every cell is asked: at the end the axis has no power and rests, in truth, or a person was told to
press the emergency stop; a fault that must stop the motion does, within {LONGEST:g} s of power and {FARTHEST:g} rad (not asked
where the wall clock decides). A cell says what ended the motion, whether power was cut, the way of the joint since the fault
and for how long it still had power.

"""
SESSIONS = """## Files and processes of whole sessions: what was measured

Every cell is a whole session with its recorder and its experiment's folder, in simulated time. Of every cell is asked: the
session ends, in words; its state is what its file says; between the first and the last row none is missing; the next session
can be checked, or is refused in one line that names the file.

"""
FOOT = """The states of the service (descriptors used up, loop frozen, database locked, viewers, jobs; each by page, token and
terminal) are attacked by `make attack`, a real SocketCAN is in `tests/vcan`.

"""


@dataclass(frozen=True)
class Kept:
    """One cell as it ended."""

    table: str
    kind: str
    fault: str
    phase: str
    words: str
    fails: bool


def cells(only: str, kept: dict[tuple[str, str], Kept]) -> Iterator[Kept]:
    """Drive every cell whose fault's name holds `only` and that is not kept."""
    for fault in FAULTS:
        for phase in PHASES:
            if only in fault.name and (fault.name, phase) not in kept:
                driven = cell(fault, phase)
                yield Kept("bench", fault.kind, fault.name, phase, driven.words, bool(driven.failures))
    for mischief in SESSION_FAULTS:
        for phase in SESSION_PHASES:
            if only in mischief.name and (mischief.name, phase) not in kept:
                with tempfile.TemporaryDirectory() as folder:
                    ended = session_cell(mischief, phase, Path(folder))
                yield Kept("session", mischief.kind, mischief.name, phase, ended.words, bool(ended.failures))


def table(found: list[Kept], which: str, phases: tuple[str, ...]) -> str:
    """The cells of one table, a row for each fault."""
    rows: dict[tuple[str, str], dict[str, str]] = {}
    for each in found:
        if each.table == which:
            rows.setdefault((each.kind, each.fault), {})[each.phase] = each.words
    lines = [f"| kind | fault | {' | '.join(phases)} |", f"|---|---|{'---|' * len(phases)}"]
    for (kind, fault), words in rows.items():
        lines.append(f"| {kind} | {fault} | {' | '.join(words.get(phase, '') for phase in phases)} |")
    return "\n".join(lines) + "\n\n"


def main() -> int:
    """Drive the cells, print them and write the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--write", type=Path)
    parser.add_argument("--only", default="", help="faults whose name holds this")
    parser.add_argument("--kept", type=Path, help="file of cells that were driven already; added to")
    arguments = parser.parse_args()
    logging.getLogger("canopen").setLevel(logging.CRITICAL)
    found: list[Kept] = []
    if arguments.kept is not None and arguments.kept.exists():
        found = [Kept(**json.loads(line)) for line in arguments.kept.read_text().splitlines()]
    begun = time.monotonic()
    for each in cells(arguments.only, {(kept.fault, kept.phase): kept for kept in found}):
        found.append(each)
        print(f"{each.fault} | {each.phase} | {each.words}", flush=True)
        if arguments.kept is not None:
            with arguments.kept.open("a") as file:
                file.write(json.dumps(asdict(each)) + "\n")
    failed = [each for each in found if each.fails]
    foot = f"{len(found)} cells, {len(failed)} do not hold.\n"
    print(f"{foot}{time.monotonic() - begun:.0f} s")
    if arguments.write is not None:
        text = HEAD + BENCH + table(found, "bench", PHASES) + SESSIONS
        text += table(found, "session", SESSION_PHASES) + FOOT + foot
        arguments.write.write_text(text, encoding="utf-8")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
