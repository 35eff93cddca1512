"""What makes the code hard to change is counted, and no count rises."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_no_count_has_risen():
    done = subprocess.run(
        [sys.executable, ROOT / ".ci" / "counts"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "dict[str, Any]: " in done.stdout
