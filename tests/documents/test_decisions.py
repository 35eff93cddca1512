"""Decisions are numbered, dated and listed."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


def check(docs: Path) -> tuple[int, str]:
    done = subprocess.run(
        [sys.executable, docs / "index_decisions.py", "--check"], capture_output=True, text=True, check=False
    )
    return done.returncode, done.stdout + done.stderr


def test_every_decision_has_a_number_a_date_and_a_state_and_stands_in_the_list():
    assert check(DOCS) == (0, "")


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("## signals 2. ", "## signals 3. ", "signals.md: signals 3: should be signals 2"),
        ("2026-11-22 · holds\n\nA Butterworth", "A Butterworth", "signals.md: signals 1: a line like"),
        (
            "amended by signals 9",
            "amended by signals 99",
            "signals.md: signals 2: there is no decision signals 99",
        ),
        ("## signals 3. Records", "## signals 3. Slow records", "run `python docs/index_decisions.py`"),
    ],
)
def test_what_is_wrong_with_a_decision_is_said(tmp_path: Path, before: str, after: str, said: str):
    shutil.copytree(DOCS / "decisions", tmp_path / "decisions")
    shutil.copy(DOCS / "index_decisions.py", tmp_path)
    file = tmp_path / "decisions" / "signals.md"
    text = file.read_text(encoding="utf-8")
    assert before in text
    file.write_text(text.replace(before, after), encoding="utf-8")
    status, words = check(tmp_path)
    assert status == 1
    assert said in words
