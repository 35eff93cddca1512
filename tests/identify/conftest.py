"""Measured data of public machines, where they are at hand."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]


def measured(name: str) -> Path:
    """Folder of a measured experiment; skips the test where it is absent."""
    root = Path(os.environ.get("COULOMB_MEASURED_DATA", REPOSITORY.parent / "shared" / "data"))
    if not (root / name / "experiment.yaml").is_file():
        pytest.skip(f"measured data '{name}' not found in {root}; set COULOMB_MEASURED_DATA to their folder")
    return root / name


@pytest.fixture(scope="session")
def emps() -> Path:
    """The EMPS drive: one slide, 1 kHz."""
    return measured("emps")


@pytest.fixture(scope="session")
def tx40() -> Path:
    """The Stäubli TX40: six joints, 5 kHz."""
    return measured("tx40")
