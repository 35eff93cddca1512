"""Records of the test joint with a known secret, each made and diagnosed once."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

import identify
from tests.plants.single_joint import record, write_experiment

Diagnosed = Callable[..., identify.Diagnosis]


@pytest.fixture(scope="session")
def hidden(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Folder of an experiment of the test joint with these effects hidden in it."""

    @cache
    def make(
        *effects: tuple[str, float], seed: int = 11, payloads: tuple[float, ...] = (0.0, 2.0, 4.0)
    ) -> Path:
        folder = tmp_path_factory.mktemp("hidden") / "experiment"
        made = record(dict(effects), seed=seed, duration=30.0, rate=250.0, repeats=2, payload_masses=payloads)
        return write_experiment(folder, made)

    return make


@pytest.fixture(scope="session")
def diagnosed(hidden: Callable[..., Path]) -> Diagnosed:
    """The diagnosis of such an experiment."""

    @cache
    def make(*effects: tuple[str, float], **options: object) -> identify.Diagnosis:
        return identify.diagnose(identify.load_experiment(hidden(*effects, **options)))

    return make
