"""The whole matrix: `python -m tests.faults --write docs/faults.md`. Exit status 1 where a cell does not hold.

With `--kept FILE` every cell is kept as it ends, and one that is there already is not driven again. `--part` drives one table
and leaves the others in the document as they are; `vcan` is driven where there is one: `tests/with-vcan .venv/bin/python -m
tests.faults --part vcan --write docs/faults.md`.
"""

import argparse
import json
import logging
import re
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from tests.faults.matrix import FARTHEST, FAULTS, LONGEST, PHASES, cell
from tests.faults.on_vcan import VCAN_PHASES, vcan_cells
from tests.faults.service import LONGEST as STOP_LONGEST
from tests.faults.service import SERVICE_PHASES, SERVICE_STATES, service_cells
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
SERVICE = f"""## States of the service: the stop

Every cell is a service in a process of its own with 1024 descriptors, which moves the rig in real time; the axis is watched
from outside, in the samples in shared memory. A cell of *slow* and *fast* has the time from the stop until rest by the page's
button / by a program with a token / by what `coulomb stop` does (the time to load its program comes on top), each in a motion
of its own; *stopping*: all three at the same time while another stop brakes, from that one on. Asked of every cell: rest within
{STOP_LONGEST:g} s; the session ends and says that it was stopped; an armed axis stays where it is. Where nothing moves (*before*,
*checked*, *identifying*) all three are asked as well; nothing begins to move, and the service goes on. *Descriptors out*: 1100
silent connections; *loop frozen*: the event loop sleeps for 4 s; *database locked*: another process holds it; *sixty viewers*,
half of whom never read; *jobs full*: 40 plans wait to be computed; *upload bombs*: 600 MB in a small archive, again and again;
*header bombs*: heads of 4000 fields from strangers on 100 connections; *talking viewers*: four live views into which frames are
sent as fast as they are taken.

"""
VCAN = """## A part of it over the kernel's CAN

Every cell is a whole session on vcan, in user-mode Linux where the kernel has none, with the simulated drive in a process of
its own. Of every cell is asked: the fault ends the session, in words; the drive says itself, asked by SDO afterwards, that it
has no power and stands still, or a person was told to press the emergency stop. A cell says what ended the motion and the way
of the joint since the fault.

"""
FOOT = """`make attack` stops under attack in more ways than these, and with TLS; more of a real SocketCAN is in `tests/vcan`.

"""


@dataclass(frozen=True)
class Part:
    """One table: its heading with what is asked, and its columns."""

    text: str
    phases: tuple[str, ...]


PARTS = {
    "bench": Part(BENCH, PHASES),
    "session": Part(SESSIONS, SESSION_PHASES),
    "service": Part(SERVICE, SERVICE_PHASES),
    "vcan": Part(VCAN, VCAN_PHASES),
}
COLUMNS = {phase for part in PARTS.values() for phase in part.phases}


@dataclass(frozen=True)
class Kept:
    """One cell as it ended."""

    table: str
    kind: str
    fault: str
    phase: str
    words: str
    fails: bool


def cells(parts: list[str], only: str, kept: set[tuple[str, str, str]]) -> Iterator[Kept]:
    """Drive every cell of these tables whose fault's name holds `only` and that is not kept."""
    for fault in FAULTS if "bench" in parts else ():
        for phase in PHASES:
            if only in fault.name and ("bench", fault.name, phase) not in kept:
                driven = cell(fault, phase)
                yield Kept("bench", fault.kind, fault.name, phase, driven.words, bool(driven.failures))
    for mischief in SESSION_FAULTS if "session" in parts else ():
        for phase in SESSION_PHASES:
            if only in mischief.name and ("session", mischief.name, phase) not in kept:
                with tempfile.TemporaryDirectory() as folder:
                    ended = session_cell(mischief, phase, Path(folder))
                yield Kept("session", mischief.kind, mischief.name, phase, ended.words, bool(ended.failures))
    for state in SERVICE_STATES if "service" in parts else ():
        name = state.__name__.replace("_", " ")
        phases = [phase for phase in SERVICE_PHASES if ("service", name, phase) not in kept]
        for asked in service_cells(state, phases) if only in name and phases else ():
            yield Kept("service", "service", name, asked.phase, asked.words, bool(asked.failures))
    if "vcan" in parts:
        for driven in vcan_cells(only, {(fault, phase) for part, fault, phase in kept if part == "vcan"}):
            yield Kept("vcan", "bus", driven.fault, driven.phase, driven.words, bool(driven.failures))


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


def document(found: list[Kept], before: str) -> str:
    """The whole of it: what was driven now, and the other tables as the document before has them."""
    sections = re.split(r"\n(?=## )", before.partition("\n`make attack`")[0].partition("\nThe states of")[0])
    text = HEAD
    for name, part in PARTS.items():
        heading = part.text.partition("\n")[0]
        if any(each.table == name for each in found):
            text += part.text + table(found, name, part.phases)
        else:
            text += "".join(f"{section.strip()}\n\n" for section in sections if section.startswith(heading))
    counted = [cell for line in text.splitlines() if line.startswith("| ") for cell in line.split(" | ")[2:]]
    counted = [cell for cell in (cell.strip(" |") for cell in counted) if cell and cell not in COLUMNS]
    failing = sum("**fails**" in cell for cell in counted)
    return text + FOOT + f"{len(counted)} cells, {failing} do not hold.\n"


def main() -> int:
    """Drive the cells, print them and write the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--write", type=Path)
    parser.add_argument("--only", default="", help="faults whose name holds this")
    parser.add_argument(
        "--part", choices=list(PARTS), action="append", help="tables; all but vcan if not said"
    )
    parser.add_argument("--kept", type=Path, help="file of cells that were driven already; added to")
    arguments = parser.parse_args()
    logging.getLogger("canopen").setLevel(logging.CRITICAL)
    parts = arguments.part or [name for name in PARTS if name != "vcan"]
    found: list[Kept] = []
    if arguments.kept is not None and arguments.kept.exists():
        found = [Kept(**json.loads(line)) for line in arguments.kept.read_text().splitlines()]
    begun = time.monotonic()
    for each in cells(parts, arguments.only, {(kept.table, kept.fault, kept.phase) for kept in found}):
        found.append(each)
        print(f"{each.fault} | {each.phase} | {each.words}", flush=True)
        if arguments.kept is not None:
            with arguments.kept.open("a") as file:
                file.write(json.dumps(asdict(each)) + "\n")
    failed = [each for each in found if each.fails]
    print(f"{len(found)} cells, {len(failed)} do not hold.\n{time.monotonic() - begun:.0f} s")
    if arguments.write is not None:
        before = arguments.write.read_text(encoding="utf-8") if arguments.write.exists() else ""
        arguments.write.write_text(document(found, before), encoding="utf-8")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
