"""A record with something hidden that only the user knows a formula for."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.plants.single_joint import record, write_experiment


@pytest.fixture
def hidden_stretch(tmp_path: Path) -> Path:
    """The test joint leans on a bumper, and the user suspects it."""
    made = record({"one-sided-bumper": 1.0}, seed=3, duration=30.0, rate=250.0)
    folder = write_experiment(tmp_path / "experiment", made)
    (folder / "bumper.yaml").write_text(
        "name: lean-on-bumper\n"
        'columns: ["max(0, q - edge)**1.5"]\n'
        "constants:\n"
        "  edge: {from: 0.3, to: 1.0, count: 15}\n"
        "variable: q\n"
    )
    with (folder / "experiment.yaml").open("a") as stream:
        stream.write("effects: [bumper.yaml]\n")
    return folder
