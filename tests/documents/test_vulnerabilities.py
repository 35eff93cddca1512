"""Known vulnerabilities of the locked dependencies are found without a network."""

import json
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / ".ci" / "vulnerabilities"
RANGE = [{"introduced": "0"}, {"fixed": "1.5"}, {"introduced": "2.0"}, {"last_affected": "2.3"}]


def audited(tmp_path, version, **report):
    lock, export = tmp_path / "some.lock", tmp_path / "all.zip"
    lock.write_text(
        f"some-thing[extra]=={version} ; python_version > '3' \\\n    --hash=sha256:00\nother==1.0\n"
    )
    affected = {
        "package": {"ecosystem": "PyPI", "name": "Some_Thing"},
        "ranges": [{"type": "ECOSYSTEM", "events": RANGE}],
    }
    with zipfile.ZipFile(export, "w") as out:
        out.writestr(
            "A.json", json.dumps({"id": "A-1", "summary": "reads too much", "affected": [affected]} | report)
        )
    return subprocess.run([sys.executable, SCRIPT, export, lock], capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("version", "found"),
    [
        ("0.1", True),
        ("1.4.9", True),
        ("1.5", False),
        ("1.9", False),
        ("2.0", True),
        ("2.3", True),
        ("2.4rc1", False),
    ],
)
def test_a_version_within_a_range_is_reported(tmp_path, version, found):
    ran = audited(tmp_path, version)
    assert (ran.returncode, ran.stdout.startswith(f"some-thing {version}: A-1 reads too much")) == (
        int(found),
        found,
    )


def test_what_was_withdrawn_is_not(tmp_path):
    ran = audited(tmp_path, "0.1", withdrawn="2026-01-01T00:00:00Z")
    assert (ran.returncode, ran.stdout) == (0, "2 dependencies, no vulnerability known\n")


def test_what_is_no_export_is_refused_in_one_line(tmp_path):
    (tmp_path / "all.zip").write_bytes(b"x")
    (tmp_path / "some.lock").write_text("a==1\n")
    ran = subprocess.run(
        [sys.executable, SCRIPT, tmp_path / "all.zip", tmp_path / "some.lock"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 2
    assert len(ran.stderr.splitlines()) == 1
