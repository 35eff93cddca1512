"""A wrong file of controllers is refused in the words of the file, never in those of the program."""

from __future__ import annotations

import pytest

from identify.recording import InputError
from identify.simulation.controller import read_controllers


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "holds no fields; joints are needed"),
        ("hello", "holds no fields; joints are needed"),
        ("- 1\n- 2\n", "holds no fields; joints are needed"),
        ("joints: 5\n", "line 1: joints: must be a list"),
        ("format: 1\njoints: []\n", "line 1: format: unknown field"),
        ("joints: []\n", "joints: at least 1 is needed"),
        (
            "joints:\n  - {joint: j1, position: .nan, velocity: 1}\n",
            "joints[0].position: input should be a finite number",
        ),
        (
            "joints:\n  - {joint: j1, position: 1, velocity: true}\n",
            "joints[0].velocity: input should be a valid number",
        ),
        ("joints:\n  - {joint: j1}\n  - {joint: 3.5}\n", "line 2: joints[0].position: is missing"),
    ],
)
def test_a_wrong_file_is_refused_in_its_own_words(tmp_path, text, said):
    path = tmp_path / "controllers.yaml"
    path.write_text(text)
    with pytest.raises(InputError) as refused:
        read_controllers(path)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)
    assert "ControllerFile" not in str(refused.value)
