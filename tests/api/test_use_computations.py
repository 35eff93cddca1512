"""What is computed of a model in a process of its own: how far it is, said from nothing to all and never back."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

import identify
import identify.export.write
import identify.simulation.simulate
from api.service import use_computations


def told_all(progress):
    for done in (0.0, 0.5, 1.0):
        progress(done, "a step")


@pytest.fixture
def heard(monkeypatch):
    """Progress that was said, of computations that only say theirs."""
    monkeypatch.setattr(use_computations, "load_experiment", lambda path: SimpleNamespace(sessions=()))

    def identified(loaded, model, add=(), progress=None):
        if progress is not None:
            told_all(progress)
        return model

    monkeypatch.setattr(identify, "identify", identified)
    return []


def saying(heard):
    return lambda done, step: heard.append(done)


def rises_from_nothing_to(heard, end):
    assert heard[0] == 0.0
    assert heard == sorted(heard)
    assert heard[-1] == pytest.approx(end)


@pytest.mark.parametrize(("model", "beside"), [("rigid", "usual"), ("usual", None)])
def test_motion_is_simulated_beside_the_usual_model_unless_it_is_that(monkeypatch, heard, model, beside):
    seen = []

    def simulated(result, usual, horizons, driven_by, progress, keep):
        told_all(progress)
        seen.append((result, usual, driven_by, horizons))
        return "document"

    monkeypatch.setattr(identify.simulation.simulate, "simulated", simulated)
    monkeypatch.setattr(use_computations, "stored_runs", lambda kept: b"")
    found = use_computations.simulate(saying(heard), "arm", model, [], "estimated", (0.5,))
    assert (found.document, seen) == ("document", [(model, beside, "estimated", (0.5,))])
    rises_from_nothing_to(heard, 0.9)  # what is left is to be stored


def test_an_export_is_half_identified_and_half_written(monkeypatch, heard, tmp_path):
    monkeypatch.setattr(
        identify.export.write, "write_export", lambda result, target: (result, target.parent.is_dir())
    )
    target = tmp_path / "export" / "arm.py"
    assert use_computations.export(saying(heard), "arm", "rigid", [], str(target)) == ("rigid", True)
    rises_from_nothing_to(heard, 0.5)
