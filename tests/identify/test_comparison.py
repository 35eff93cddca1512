"""Models side by side: what is refused before anything is computed, and names of the figures' files."""

from __future__ import annotations

import pytest

from identify import comparison
from identify.recording import InputError


@pytest.fixture
def asked(monkeypatch) -> list[tuple[str, tuple[str, ...]]]:
    """Identifications that were asked for: model and effects added."""
    calls: list[tuple[str, tuple[str, ...]]] = []
    monkeypatch.setattr(
        comparison,
        "identify",
        lambda experiment, model, add=(): calls.append((model, tuple(add))) or f"{model}, {list(add)}",
    )
    return calls


@pytest.mark.parametrize(
    ("models", "add", "calls", "names"),
    [
        ([], [], [("usual", ()), ("load-velocity", ())], ["usual", "load-velocity"]),
        ([], ["stribeck"], [("usual", ()), ("usual", ("stribeck",))], ["usual", "usual + stribeck"]),
        (["rigid"], [], [("rigid", ())], ["rigid"]),
        (
            ["rigid", "usual"],
            ["stribeck", "delay@j1"],
            [("rigid", ()), ("usual", ("stribeck", "delay@j1"))],
            ["rigid", "usual + stribeck + delay@j1"],
        ),
    ],
)
def test_effects_go_to_the_last_model_and_a_single_one_stands_beside_itself(asked, models, add, calls, names):
    assert list(comparison.compare(None, models, add)) == names  # type: ignore[arg-type]
    assert asked == calls


def test_a_model_that_is_named_twice_is_refused_before_anything_is_computed(asked):
    with pytest.raises(InputError, match="--model usual: named twice"):
        comparison.compare(None, ["usual", "usual"])  # type: ignore[arg-type]
    assert asked == []


def test_figures_go_into_a_folder_and_over_no_file(tmp_path):
    (tmp_path / "out").write_text("somebody's notes")
    with pytest.raises(InputError, match="is a file; give a folder"):
        comparison.write_figures({}, tmp_path / "out")
    assert (tmp_path / "out").read_text() == "somebody's notes"


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("usual + stribeck", "usual-stribeck"),
        ("session-00.csv.gz", "session-00"),
        ("session-00.csv", "session-00"),
        ("2026-11-28.h5", "2026-11-28"),
        ("a.hdf5", "a"),
        ("arm/left: 7 kg", "arm-left-7-kg"),
        ("delay@j1", "delay@j1"),
    ],
)
def test_names_of_files_are_what_every_file_system_takes(text, name):
    assert comparison._file_name(text) == name
