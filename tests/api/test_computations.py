"""What jobs compute: which files stand where, and how far it is, said from nothing to all and never back."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

import identify
from api.service import computations


@pytest.fixture
def heard():
    """Progress that was said."""
    return []


@pytest.fixture
def progress(heard):
    return lambda done, step: heard.append(done)


@pytest.fixture
def loaded(monkeypatch):
    """Two sessions, of which the experiment's file lists the second first, and two joints."""
    joints = (SimpleNamespace(name="j1"), SimpleNamespace(name="j2"))
    sessions = tuple(SimpleNamespace(file=file) for file in ("a.csv", "b.csv"))
    experiment = SimpleNamespace(sessions=sessions, robot=SimpleNamespace(joints=joints))
    monkeypatch.setattr(computations, "load_experiment", lambda path: experiment)
    monkeypatch.setattr(computations, "_places", lambda path: {"b.csv": 4, "a.csv": 7})
    monkeypatch.setattr(computations, "data_fingerprint", lambda path: f"of {path}")
    return experiment


def told_all(progress):
    for done in (0.0, 0.5, 1.0):
        progress(done, "a step")


def rises_from_nothing_to(heard, end):
    assert heard[0] == 0.0
    assert heard == sorted(heard)
    assert heard[-1] == pytest.approx(end)


@pytest.fixture
def identified(monkeypatch, loaded, document):
    """What `identify` was asked for, and the predictions that were written."""
    asked, written = [], {}

    def identify_(experiment, model, add, progress):
        assert experiment is loaded
        told_all(progress)
        asked.append((model, list(add)))
        return SimpleNamespace(document=lambda: document, prediction=lambda file, joint: (file, joint))

    def write(folder, place, joint, prediction):
        written[(folder.name, place, joint)] = prediction

    monkeypatch.setattr(identify, "identify", identify_)
    monkeypatch.setattr(computations, "write_prediction", write)
    return SimpleNamespace(asked=asked, written=written)


@pytest.fixture
def document():
    """Stands for what an identification found."""
    return SimpleNamespace(json_text=lambda indent: f'{{"indent": {indent}}}')


@dataclass(frozen=True)
class Diagnosis:
    """A diagnosis whose document is what it says of motion."""

    joints: list
    fitted: str = "fitted"
    added: str = "added"
    motion: object = None

    def document(self):
        return self.motion


def test_a_fit_keeps_each_prediction_under_its_session_s_place_and_its_joint_s(
    identified, progress, heard, document, tmp_path
):
    found = computations.fit(progress, "arm", "usual", ["stribeck@j1"], str(tmp_path / "m2" / "f1"))
    assert identified.asked == [("usual", ["stribeck@j1"])]
    assert identified.written == {
        ("f1", 7, 0): ("a.csv", "j1"),
        ("f1", 7, 1): ("a.csv", "j2"),
        ("f1", 4, 0): ("b.csv", "j1"),
        ("f1", 4, 1): ("b.csv", "j2"),
    }
    assert (found.identification, found.data, found.folder) == (document, "of arm", tmp_path / "m2" / "f1")
    assert (found.folder / "identification.json").read_text() == '{"indent": 1}'
    assert heard[:3] == pytest.approx([0.0, 0.4, 0.8])
    assert heard[3:] == pytest.approx([0.8, 0.85, 0.9, 0.95])


def test_an_improvement_fits_each_step_s_model_into_a_version_of_its_own(
    identified, progress, heard, monkeypatch, tmp_path
):
    story = SimpleNamespace(steps=[SimpleNamespace(added=each) for each in (None, "stribeck@j1", "delay@j2")])
    asked = []

    def improve(experiment, model, add, progress, motion):
        told_all(progress)
        asked.append((model, add, motion))
        return SimpleNamespace(document=lambda: story)

    monkeypatch.setattr(identify, "improve", improve)
    found = computations.improve(progress, "arm", "usual", ["cogging@j1"], str(tmp_path), 5, motion=True)
    assert asked == [("usual", ["cogging@j1"], True)]
    assert found.improvement is story
    assert [(version.add, version.change, version.fit.folder) for version in found.versions] == [
        (["cogging@j1", "stribeck@j1"], "stribeck@j1", tmp_path / "m5" / "f1"),
        (["cogging@j1", "stribeck@j1", "delay@j2"], "delay@j2", tmp_path / "m6" / "f1"),
    ]
    assert [add for _, add in identified.asked] == [version.add for version in found.versions]
    rises_from_nothing_to(heard, 0.8 + 0.2 * 0.95)
    assert heard[:3] == pytest.approx([0.0, 0.3, 0.6])
    assert heard[3:6] == pytest.approx([0.6, 0.68, 0.76])


@pytest.mark.parametrize("motion", [False, True])
def test_a_diagnosis_has_looked_at_every_candidate_of_every_joint_before_it_is_done(
    loaded, progress, heard, monkeypatch, tmp_path, motion
):
    import identify.diagnosis.motion_judgement as motions
    import identify.diagnosis.with_candidate as looks

    joints = [SimpleNamespace(findings=["a", "b", "c"]), SimpleNamespace(findings=["d"])]

    def diagnosed(experiment, model, add, progress):
        told_all(progress)
        return Diagnosis(joints)

    shown, written = [], []

    def predicted(diagnosis, finding, sessions):
        return [SimpleNamespace(predicted=(finding, session.file)) for session in sessions]

    def shown_findings(diagnosis, joint, most):
        shown.append(most)
        return list(reversed(joints[joint].findings))

    monkeypatch.setattr(identify, "diagnose", diagnosed)
    monkeypatch.setattr(motions, "effects_on_motion", lambda fitted, added: (fitted, added))
    monkeypatch.setattr(looks, "shown_findings", shown_findings)
    monkeypatch.setattr(looks, "predictions_with", predicted)
    monkeypatch.setattr(computations, "write_candidate", lambda *what: written.append(what))
    document = computations.diagnose(progress, "arm", "usual", [], str(tmp_path), motion)
    assert document == (("fitted", "added") if motion else None)
    assert shown == [6, 6]
    of_first = [
        (tmp_path, place, 0, rank, (name, file))
        for rank, name in ((3, "c"), (2, "b"), (1, "a"))
        for place, file in ((7, "a.csv"), (4, "b.csv"))
    ]
    assert written[:6] == of_first
    assert [each[2:4] for each in written[6:]] == [(1, 1), (1, 1)]
    searched = 0.5 if motion else 0.85
    assert heard == pytest.approx(
        [0.0, searched / 2, searched, *([0.5] if motion else []), *(0.85 + 0.15 * k / 4 for k in range(4))]
    )
