"""Disturbances inside the position loop are no missing effect, and what is missing is still found."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import identify
from tests.plants.closed_loop import draw_arm, simulate, write_arm


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> dict[str, identify.Diagnosis]:
    """The diagnoses of arms of their own, all simulated side by side."""
    random = np.random.default_rng(5)
    arms = {
        "pd": draw_arm(random, controller="pd", motion="fourier", bandwidth=5.0),
        "pid": draw_arm(random, controller="pid", motion="ways", bandwidth=8.0),
        "cascade": draw_arm(random, controller="cascade", motion="fourier", bandwidth=10.0),
        "late": draw_arm(random, controller="pd", motion="ways", delay=0.012),
        "stiction": draw_arm(random, controller="pid", motion="fourier", stiction=25.0),
    }
    folder: Path = tmp_path_factory.mktemp("loops")
    records = simulate(list(arms.values()))
    return {
        name: identify.diagnose(identify.load_experiment(write_arm(folder / name, arm, sessions)))
        for (name, arm), sessions in zip(arms.items(), records, strict=True)
    }


@pytest.mark.parametrize("controller", ["pd", "pid", "cascade"])
def test_a_disturbance_that_the_controller_answers_is_no_delay_and_no_elasticity(said, controller):
    joint = said[controller].joints[0]
    assert (joint.verdict, joint.missing) == ("adequate", ())
    assert joint.probable.adequate > 0.5


def test_a_true_delay_is_found_in_spite_of_the_disturbance(said):
    joint = said["late"].joints[0]
    assert joint.missing[0].effect.name == "delay"
    found = joint.document().candidate("delay")
    assert found is not None
    assert found.estimates is not None
    assert found.estimates[0].value == pytest.approx(0.012, rel=0.4)


def test_stiction_is_found_in_spite_of_the_disturbance(said):
    joint = said["stiction"].joints[0]
    assert {term.effect.name for term in joint.missing} & {"stribeck", "load-stribeck"}
