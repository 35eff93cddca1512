"""The page that explains the diagnosis has every constant that decides, and there are few of them."""

from __future__ import annotations

import re
from pathlib import Path

from identify.diagnosis import deciding_constants

PAGE = Path(__file__).parents[3] / "docs" / "diagnosis.md"
ELSEWHERE = {"LARGEST_DEFLECTION"}


def test_the_table_of_the_page_is_that_of_the_module_and_fits_a_screen():
    section = PAGE.read_text(encoding="utf-8").partition("## The constants")[2].partition("\n## ")[0]
    rows = [line for line in section.splitlines() if line.startswith("| `")]
    listed = [name for line in rows for name in re.findall(r"`([A-Z_]+)`", line.split("|")[1])]
    constants = {name for name in vars(deciding_constants) if name.isupper()}
    assert len(listed) == len(set(listed)) <= 20
    assert set(listed) == constants | ELSEWHERE
