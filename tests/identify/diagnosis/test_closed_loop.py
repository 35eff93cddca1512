"""Disturbances inside the position loop are no missing effect, and what is missing is still found."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import identify
from tests.plants.closed_loop import draw_arm, simulate, write_arm

Diagnosed = Callable[[str], identify.Diagnosis]


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory: pytest.TempPathFactory) -> Diagnosed:
    """The diagnosis of an arm by name; all are simulated side by side."""
    random = np.random.default_rng(5)
    few: dict[str, object] = {"duration": 24.0, "payloads": (0.0, 5.0)}
    arms = {
        "pd": draw_arm(random, controller="pd", motion="fourier", bandwidth=5.0, **few),
        "pid": draw_arm(random, controller="pid", motion="ways", bandwidth=8.0, **few),
        "late": draw_arm(random, controller="pd", motion="ways", delay=0.012, **few),
        "stiction": draw_arm(random, controller="pid", motion="fourier", stiction=25.0, **few),
    }
    records = dict(zip(arms, simulate(list(arms.values())), strict=True))
    folder: Path = tmp_path_factory.mktemp("loops")

    def make(name: str) -> identify.Diagnosis:
        return identify.diagnose(
            identify.load_experiment(write_arm(folder / name, arms[name], records[name]))
        )

    return make


@pytest.mark.parametrize("controller", ["pd", "pid"])
def test_a_disturbance_that_the_controller_answers_is_no_delay_and_no_elasticity(diagnosed, controller):
    joint = diagnosed(controller).joints[0]
    assert (joint.verdict, joint.missing) == ("adequate", ())
    assert joint.probable.adequate > 0.5


def test_a_true_delay_is_found_in_spite_of_the_disturbance(diagnosed):
    joint = diagnosed("late").joints[0]
    assert joint.missing[0].effect.name == "delay"
    found = joint.document().candidate("delay")
    assert found is not None
    assert found.estimates is not None
    assert found.estimates[0].value == pytest.approx(0.012, rel=0.4)


def test_stiction_is_found_in_spite_of_the_disturbance(diagnosed):
    joint = diagnosed("stiction").joints[0]
    assert {term.effect.name for term in joint.missing} & {"stribeck", "load-stribeck"}
