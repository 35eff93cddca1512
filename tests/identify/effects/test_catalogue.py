"""The catalogue against the contract and against its own document."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from identify.effects import catalogue as catalogue_module
from identify.effects.catalogue import KnownEffects, built_in, catalogue, effects
from identify.effects.document import effects_document
from identify.effects.motion import BlockMemory
from tests.identify.effects.motions import motion_of
from tests.identify.effects.summaries import summary_of

CONTRACT = {
    "viscous",
    "coulomb",
    "offset",
    "viscous-asymmetric",
    "viscous-quadratic",
    "viscous-cubic",
    "viscous-power",
    "stribeck",
    "load-friction",
    "load-friction-asymmetric",
    "load-stribeck",
    "friction-position",
    "friction-temperature",
    "friction-warmup",
    "presliding",
    "backlash",
    "torque-ripple",
    "current-ripple",
    "joint-spring",
    "gain-saturation",
    "drive-gain",
    "delay",
    "elasticity",
    "motor-inertia",
    "coupled-friction",
    "payload-mass",
    "payload-com",
    "gravity-tilt",
}


def test_every_name_of_the_contract_is_there_with_everything_said_of_it():
    entries = {entry.effect: entry for entry in catalogue()}
    assert entries.keys() >= CONTRACT
    for entry in entries.values():
        in_contract = {"effect", "group", "equation", "explanation", "regressors", "needs", "source"}
        assert in_contract <= entry.to_json().keys()
        assert "Check" in entry.explanation
        assert entry.source


def test_indistinguishable_effects_exist():
    names = {entry.effect for entry in catalogue()}
    for entry in catalogue():
        assert set(entry.indistinguishable_from) <= names


def test_the_document_is_the_catalogue():
    document = Path(__file__).parents[3] / "docs" / "effects.md"
    assert document.read_text(encoding="utf-8") == effects_document(), (
        "run: coulomb effects --markdown > docs/effects.md"
    )


def test_our_own_effects_are_found_without_asking_what_is_installed(monkeypatch):
    def asked(**_):
        raise AssertionError("read the metadata of all that is installed")

    expected = effects()["load-friction"]
    monkeypatch.setattr(catalogue_module, "entry_points", asked)
    effects.cache_clear()
    known = KnownEffects()
    assert known["load-friction"] is expected
    assert "viscous" in known
    with pytest.raises(AssertionError, match="all that is installed"):
        known["end-stop-bumper"]


def test_what_is_known_by_name_is_the_whole_catalogue():
    known = KnownEffects()
    assert dict(known) == effects()
    assert list(known) == [effect.effect for effect in catalogue()]
    assert "no-such-effect" not in known


@pytest.mark.parametrize("effect", built_in(), ids=lambda effect: effect.name)
def test_an_effect_declares_the_load_and_the_torque_that_its_columns_are_made_of(effect):
    """What is fitted again when the load changes, and what no unknown payload may stand beside, hangs on the declaration."""
    plain = motion_of()
    other = 1.7 * plain.load + np.sin(9.0 * plain.time)

    def changes(**changed):
        moved = [
            effect.columns(motion_of(memory=BlockMemory(), temperature=25 + plain.time, **facts), constants)
            for constants in effect.grid(summary_of())
            for facts in ({}, changed)
        ]
        return any(not np.allclose(one, two) for one, two in zip(moved[::2], moved[1::2], strict=True))

    of_load = {
        "load": other,
        "known_load": other,
        "load_slope_of": lambda: other,
        "gravity_gradient_of": lambda: np.column_stack([other, other]),
        "payload_gradient_of": lambda: np.column_stack([other, other, other]),
    }
    of_torque = changes(model_torque=2.0 * plain.model_torque + np.sin(8.0 * plain.time))
    assert effect.uses_torque == of_torque
    assert effect.uses_load == (of_torque or changes(**of_load))
