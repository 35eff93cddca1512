"""experiment.yaml is read strictly: each mistake gets one line that names file, line, field and what would
be right."""

import numpy as np
import pytest

from identify.recording import (
    DeclaredSession,
    InputError,
    Payload,
    append_session,
    load_experiment,
    write_experiment,
)
from identify.recording.experiment_file import read_experiment_file

JOINT = "{name: j1, type: revolute, alpha: 0.0, d: 0.0, theta: 0.0, r: 0.0, drive_gain: 2.0}"


MISTAKES = [
    # what is replaced, by what, and what the message must say
    ("format: 1", "format: 2", ["line 1", "format", "1"]),
    ("format: 1\n", "", ["format", "missing"]),
    ("format: 1", "format: one", ["line 1", "format", "'one'"]),
    ("name: bench", "name: 3", ["line 2", "name", "string", "3"]),
    ("name: bench", "name: ''", ["line 2", "name"]),
    ("name: bench", "name: bench\nname: twice", ["line 3", "'name' occurs twice", "line 2"]),
    ("gravity: [0.0, -9.81, 0.0]", "gravity: [0.0, -9.81]", ["line 4", "robot.gravity"]),
    ("gravity: [0.0, -9.81, 0.0]", "gravity: 9.81", ["line 4", "robot.gravity", "9.81"]),
    ("gravity: [0.0, -9.81, 0.0]", "gravity: [0.0, '-9.81', 0.0]", ["line 4", "robot.gravity[1]", "number"]),
    ("gravity: [0.0, -9.81, 0.0]", "gravity: [0.0, .nan, 0.0]", ["line 4", "gravity[1]", "finite"]),
    ("  gravity: [0.0, -9.81, 0.0]\n", "", ["line 3", "robot.gravity", "missing"]),
    ("gravity: [0", "gravitiy: [0", ["line 4", "robot.gravitiy", "did you mean 'gravity'"]),
    ("type: revolute", "type: turning", ["line 6", "joints[0].type", "revolute", "prismatic", "turning"]),
    ("type: revolute", "typ: revolute", ["line 6", "robot.joints[0].typ", "did you mean 'type'"]),
    ("drive_gain: 2.0", "drive_gain: two", ["line 6", "joints[0].drive_gain", "'two'"]),
    ("drive_gain: 2.0", "drive_gain: 0.0", ["line 6", "joints[0].drive_gain", "0"]),
    ("drive_gain: 2.0", "drive_gain: true", ["line 6", "joints[0].drive_gain", "True"]),
    (", drive_gain: 2.0", "", ["line 6", "joints[0]", "'drive_gain' of 'j1' is missing"]),
    ("drive_gain: 2.0", "drive_gain: 2.0, color: red", ["line 6", "joints[0].color", "unknown", "alpha"]),
    (f"    - {JOINT}", f"    - {JOINT}\n    - {JOINT}", ["joints", "'j1'", "differ"]),
    (f"\n    - {JOINT}", " []", ["line 5", "robot.joints"]),
    ("payloads:", "  drive_gain_matrix: [[2.0]]\npayloads:", ["drive_gain", "only one"]),
    (
        "drive_gain: 2.0}",
        "motor_ratio: 2.0}\n  drive_gain_matrix: [[2.0, 1.0]]",
        ["line 7", "drive_gain_matrix", "1 rows of 1"],
    ),
    ("drive_gain: 2.0}", "motor_ratio: 2.0}\n  drive_gain_matrix: [[0.0]]", ["drive_gain_matrix", "zero"]),
    ("mass: 0.0", "mass: -1.0", ["line 8", "payloads[0].mass", "-1.0"]),
    ("mass: 0.0", "mass: 1 kg", ["line 8", "payloads[0].mass", "'1 kg'"]),
    ("mass: 0.0", "mass: 1.0, com: [0, 0]", ["line 8", "payloads[0].com"]),
    ("mass: 0.0", "mass: 1.0, inertia: [0, 0, 0]", ["line 8", "payloads[0].inertia"]),
    (
        "  - {name: none, mass: 0.0}",
        "  - {name: none, mass: 0.0}\n  - {name: none, mass: 1.0}",
        ["line 9", "twice"],
    ),
    ("payload: none", "payload: disk", ["line 10", "sessions[0].payload", "'disk'", "not declared", "none"]),
    ("payload: none", "load: none", ["line 10", "sessions[0].load", "did you mean 'payload'"]),
    ("payload: none}", "payload: none, role: test}", ["line 10", "role", "identification", "validation"]),
    ("file: session-00.csv", "file: session-07.csv", ["sessions[0]", "session-07.csv", "no file"]),
    (
        "  - {file: session-00.csv, payload: none}",
        "  - {file: session-00.csv, payload: none}\n" * 2,
        ["sessions[1].file", "twice"],
    ),
    (
        "  - {file: session-00.csv, payload: none}",
        "  - {file: session-00.csv, payload: none}\n  - {file: ./session-00.csv, payload: none}",
        ["line 11", "sessions[1].file", "twice"],
    ),
    (
        f"    - {JOINT}",
        "\n".join(f"    - {JOINT.replace('j1', f'j{k}')}" for k in range(65)),
        ["joints", "65", "at most 64"],
    ),
    ("mass: 0.0", "mass: 1.0, inertia: [-1, 0, 0, 1, 0, 1]", ["line 8", "payloads[0].inertia", "negative"]),
    ("sessions:", "signals: {position_cutoff: 0}\nsessions:", ["line 9", "signals.position_cutoff"]),
    (
        "sessions:",
        "signals: {position_cutoff: [10, 20]}\nsessions:",
        ["line 9", "position_cutoff", "1 joint"],
    ),
    ("sessions:", "signals: {cutoff: 10}\nsessions:", ["line 9", "signals.cutoff", "position_cutoff"]),
    ("sessions:", "effects: [spring.yaml]\nsessions:", ["effects[0]", "spring.yaml", "no file"]),
    ("drive_gain: 2.0", "drive_gain: 2.0, limits: {position: [1.0, -1.0]}", ["line 6", "limits", "lowest"]),
    ("format: 1", "format: [1", ["line", "not valid YAML"]),
    ("format: 1", "format: !!python/object:os.system 1", ["line 1", "tag"]),
    ("format: 1", "? [a]\n: 1\nformat: 1", ["line 1", "key"]),
    ("name: bench", "name:\tbench\n\tname: x", ["line", "not valid YAML", "a tab; indent with spaces"]),
    ("format: 1", "format: true", ["line 1", "format", "should be 1"]),
    ("format: 1", "format: " + "9" * 5000, ["line 1", "too large"]),
    ("gravity: [0.0, -9.81, 0.0]", "gravity: 9.81", ["line 4", "robot.gravity", "must be a list", "9.81"]),
    ("payloads:\n  - {name: none, mass: 0.0}", "payloads: []", ["payloads", "at least 1", "none is given"]),
]


@pytest.mark.parametrize(("old", "new", "said"), MISTAKES, ids=[repr(new)[:48] for _, new, _ in MISTAKES])
def test_a_mistake_is_named_with_its_line_and_what_would_be_right(folder, old, new, said):
    path = folder / "experiment.yaml"
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError) as raised:
        load_experiment(folder)
    message = str(raised.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    for part in said:
        assert part in message


def test_an_empty_file_and_a_list_are_told_what_is_needed(folder):
    for text in ("", "- 1\n", "just words\n"):
        (folder / "experiment.yaml").write_text(text)
        with pytest.raises(InputError, match="format, name, robot"):
            load_experiment(folder)


def test_a_file_that_is_not_text_is_refused_with_its_line(folder):
    (folder / "experiment.yaml").write_bytes(b"format: 1\nname: \xff\xfe\n")
    with pytest.raises(InputError, match="line 2: not UTF-8"):
        load_experiment(folder)


def test_aliases_that_stand_for_billions_of_values_are_refused_at_once(folder):
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, 12)]
    (folder / "experiment.yaml").write_text("\n".join(lines))
    with pytest.raises(InputError, match="more than 100000 values"):
        load_experiment(folder)


def test_numbers_may_be_written_without_a_decimal_point(folder):
    path = folder / "experiment.yaml"
    path.write_text(
        path.read_text().replace("drive_gain: 2.0", "drive_gain: 2e1").replace("0.0, -9.81", "0, -9.81")
    )
    assert load_experiment(folder).drive_gain == pytest.approx(np.array([[20.0]]))


def test_words_that_old_yaml_takes_for_truth_values_are_words(folder):
    path = folder / "experiment.yaml"
    path.write_text(path.read_text().replace("none", "no"))
    assert load_experiment(folder).sessions[0].payload.name == "no"


def test_the_drive_gain_is_a_matrix_either_way(folder):
    path = folder / "experiment.yaml"
    two = JOINT.replace("j1", "j2").replace("2.0", "-3.0")
    path.write_text(path.read_text().replace(f"    - {JOINT}", f"    - {JOINT}\n    - {two}"))
    assert load_experiment(folder).drive_gain.tolist() == [[2.0, 0.0], [0.0, -3.0]]
    text = path.read_text().replace(", drive_gain: 2.0", "").replace(", drive_gain: -3.0", "")
    path.write_text(text.replace("payloads:", "  drive_gain_matrix: [[1.0, 2.0], [0.0, 4.0]]\npayloads:"))
    assert load_experiment(folder).drive_gain.tolist() == [[1.0, 2.0], [0.0, 4.0]]


def test_what_is_written_is_read_again(folder, tmp_path):
    declared = read_experiment_file(folder / "experiment.yaml")
    other = tmp_path / "other"
    assert read_experiment_file(write_experiment(other, declared)) == declared
    assert [path.name for path in other.iterdir()] == ["experiment.yaml"]


def test_sessions_are_appended_with_their_payload(folder):
    disk = Payload(name="disk", mass=3.4584, com=(1.277, 0.0, 0.0))
    append_session(folder, DeclaredSession(file="session-01.h5", payload="disk", role="validation"), disk)
    declared = read_experiment_file(folder / "experiment.yaml")
    assert [payload.name for payload in declared.payloads] == ["none", "disk"]
    assert declared.payloads[1] == disk
    assert declared.sessions[1] == DeclaredSession(file="session-01.h5", payload="disk", role="validation")


def test_a_session_that_would_break_the_experiment_is_not_appended(folder):
    before = (folder / "experiment.yaml").read_bytes()
    for session in (
        DeclaredSession(file="session-00.csv", payload="none"),
        DeclaredSession(file="session-01.csv", payload="disk"),
    ):
        with pytest.raises(InputError, match=r"sessions\[1\]"):
            append_session(folder, session)
    other = Payload(name="none", mass=1.0)
    with pytest.raises(InputError, match="twice"):
        append_session(folder, DeclaredSession(file="session-01.csv", payload="none"), other)
    assert (folder / "experiment.yaml").read_bytes() == before
