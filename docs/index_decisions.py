"""Writes the list of decisions in docs/decisions/README.md from the files beside it; `--check` only says whether it is
up to date.

    python docs/index_decisions.py [--check]

Each room has a file, each decision a heading `## ROOM N. Title` and below it a line `DATE · STATE`, where the state is
`holds`, `holds, amended by ROOM N` or `superseded by ROOM N`. The numbers of a room count up from 1. A mistake is one
line that names file and decision; the exit status is then 1.
"""

import re
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent / "decisions"
BEGIN, END = "<!-- written by docs/index_decisions.py -->", "<!-- end -->"

HEADING = re.compile(r"^## (\w+) (\d+)\. (.+)$", re.MULTILINE)
STATE = re.compile(
    r"\n\n(\d{4}-\d\d-\d\d) · (holds|holds, amended by (\w+ \d+)|superseded by (\w+ \d+))\n\n(?=\S)"
)


class Mistake(Exception):
    """One line that names the file and the decision."""


def table() -> str:
    """The list of all decisions, room by room."""
    known: set[str] = set()
    cited: list[tuple[str, str]] = []
    parts: list[str] = []
    for path in sorted(FOLDER.glob("*.md")):
        if path.name == "README.md":
            continue
        text = path.read_text(encoding="utf-8")
        title = text.partition("\n")[0].removeprefix("# Decisions: ")
        rows = [f"\n### [{title}]({path.name})\n", "| | decision | date | state |", "|---|---|---|---|"]
        for count, heading in enumerate(HEADING.finditer(text), start=1):
            room, number, name = heading.groups()
            here = f"{path.name}: {room} {number}"
            if (room, int(number)) != (path.stem, count):
                raise Mistake(
                    f"{here}: should be {path.stem} {count}; numbers count up from 1 in the order of the file"
                )
            state = STATE.match(text, heading.end())
            if state is None:
                raise Mistake(f"{here}: a line like `2026-11-28 · holds` must follow, between empty lines")
            known.add(f"{room} {number}")
            cited += [(here, other) for other in state.groups()[2:] if other]
            rows.append(f"| {room} {number} | {name} | {state[1]} | {state[2]} |")
        parts += rows
    for here, other in cited:
        if other not in known:
            raise Mistake(f"{here}: there is no decision {other}")
    return "\n".join(parts)


def main(arguments: list[str]) -> int:
    readme = FOLDER / "README.md"
    before = readme.read_text(encoding="utf-8")
    head, _, rest = before.partition(BEGIN)
    try:
        after = f"{head}{BEGIN}\n{table()}\n\n{END}{rest.partition(END)[2]}"
    except Mistake as mistake:
        print(mistake)
        return 1
    if arguments != ["--check"]:
        readme.write_text(after, encoding="utf-8")
    elif after != before:
        print("docs/decisions/README.md: is not up to date; run `python docs/index_decisions.py`")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
