"""The table of the paper's equations names what exists, and lacks no equation that the code cites."""

import importlib
import itertools
import re
from functools import reduce
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROW = re.compile(r"^\| \((\d+)\) \| [^|]+ \| ([^|]+) \|([^|]*)\|$", re.MULTILINE)
NAME = re.compile(r"`([\w.]+:[\w.]+)`")
CITED = re.compile(r"\b[Ee]q\.\s+\(?\d+(?![.\d])\)?(?:(?:\s*[-–]\s*|,\s+|\s+and\s+)\(\d+\))*")
TEXT = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
ROWS = {int(number): NAME.findall(computed) for number, computed, _ in ROW.findall(TEXT)}


def test_every_numbered_equation_has_a_row_and_a_function():
    assert sorted(ROWS) == list(range(1, 45))
    assert all(ROWS.values())


@pytest.mark.parametrize("name", sorted(set(NAME.findall(TEXT)) - {"module:object"}))
def test_what_the_table_names_exists(name: str):
    module, _, path = name.partition(":")
    reduce(getattr, path.split("."), importlib.import_module(module))


def cited_equations(text: str) -> set[int]:
    """Numbers of the paper's equations in a source text; ranges in full."""
    numbers: set[int] = set()
    for match in CITED.finditer(text):
        parts = re.split(r"\s*[-–]\s*", match.group())
        listed = [[int(number) for number in re.findall(r"\d+", part)] for part in parts]
        for before, after in itertools.pairwise(listed):
            numbers.update(range(before[-1], after[0] + 1))
        numbers.update(number for part in listed for number in part)
    return numbers


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("eq. (8)", {8}),
        ("deviations of eq. (13)-(15)", {13, 14, 15}),
        ("paper, eq. (30), (42), (43)", {30, 42, 43}),
        ("eq. (4) and (35)", {4, 35}),
        ("the payload ratio (eq. 35), which", {35}),
        ("Huber 1981, eq. 7.6.5", set()),
        ("Econometrica 59(3), eq. 6.2 and 6.4", set()),
    ],
)
def test_citations_are_read(text: str, numbers: set[int]):
    assert cited_equations(text) == numbers


def test_every_equation_that_the_code_cites_is_in_the_table():
    cited = {
        number: str(path.relative_to(ROOT))
        for room in ("api", "daq", "drivers", "identify")
        for path in sorted((ROOT / room).rglob("*.py"))
        for number in cited_equations(path.read_text(encoding="utf-8"))
    }
    assert {8, 12, 30} <= set(cited), "few citations found: the pattern no longer fits"
    assert {number: file for number, file in cited.items() if number not in ROWS} == {}
