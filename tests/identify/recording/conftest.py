"""Experiments on disk to break."""

from pathlib import Path

import pytest

EXPERIMENT = """\
format: 1
name: bench
robot:
  gravity: [0.0, -9.81, 0.0]
  joints:
    - {name: j1, type: revolute, alpha: 0.0, d: 0.0, theta: 0.0, r: 0.0, drive_gain: 2.0}
payloads:
  - {name: none, mass: 0.0}
sessions:
  - {file: session-00.csv, payload: none}
"""


def session_text(rows: int = 40, header: str = "t,q1,v1") -> str:
    """A session of one joint at 1 kHz: a parabola and a straight line."""
    lines = [f"{k / 1000},{1e-6 * k * k},{0.1 * k}" for k in range(rows)]
    return "\n".join([header, *lines]) + "\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An experiment of one joint and one session of 40 samples."""
    (tmp_path / "experiment.yaml").write_text(EXPERIMENT)
    (tmp_path / "session-00.csv").write_text(session_text())
    return tmp_path
