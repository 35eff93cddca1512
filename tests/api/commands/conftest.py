"""A rig file whose simulated drives live in this process, as a lasting drive does on a bus."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import yaml

from daq.rig import Rig
from daq.simulated_rig import simulated_rig
from drivers.simulated.rig import SimulatedRig


@pytest.fixture
def rig_file(rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Path]:
    """Writes the rig, its first axis changed, on a bus of this test's own; commands take its drives for lasting ones.

    sync_timeout : s after which its drives act without SYNC
    """
    monkeypatch.setattr("daq.homing.require_lasting_drives", lambda rig: None)

    def write(sync_timeout: float = 0.05, **axis: object) -> Path:
        settings = rig.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
        settings["bus"] = {"interface": "virtual", "channel": tmp_path.name}
        settings["axes"][0] |= axis
        settings["simulated"]["sync_timeout"] = sync_timeout
        path = tmp_path / "rig.yaml"
        path.write_text(yaml.safe_dump(settings), encoding="utf-8")
        return path

    return write


@pytest.fixture
def powered() -> Iterator[Callable[[Path], SimulatedRig]]:
    """Powers the simulated drives of a rig file for as long as the test lasts."""
    on: list[SimulatedRig] = []

    def power(file: Path) -> SimulatedRig:
        settings = Rig.load(str(file))
        on.append(simulated_rig(settings, settings.payload("none")))
        return on[-1].__enter__()

    yield power
    for each in on:
        each.__exit__(None, None, None)
