"""An experiment of several sessions for what is computed in several places."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.plants.single_joint import record, write_experiment


@pytest.fixture(scope="session")
def three_sessions(tmp_path_factory) -> Path:
    """The test joint with an elastic gear, three payload sessions of 16 s at 250 Hz."""
    recorded = record({"elasticity": 0.1}, seed=11, duration=16.0, rate=250.0, payload_masses=(0.0, 2.0, 4.0))
    return write_experiment(tmp_path_factory.mktemp("three") / "joint", recorded)
