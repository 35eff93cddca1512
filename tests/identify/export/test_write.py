"""Exports are written whole, with their certificate, and over nothing that is not an export."""

from __future__ import annotations

import errno
import os
from dataclasses import replace
from pathlib import Path

import pytest

from identify.export.write import export, write_export
from identify.identification import identify
from identify.recording import InputError
from identify.results.certificate import Certificate
from identify.results.exported_model import ExportedModelDocument


def test_targets_are_written_whole_with_a_certificate(plant, tmp_path):
    result = identify(plant, "usual", ["stribeck"])
    for name in ("arm.py", "arm.c", "arm.st", "arm.json"):
        certificate = write_export(result, tmp_path / name)
        stored = Certificate.model_validate_json((tmp_path / f"{name}.certificate.json").read_text())
        assert stored == certificate
        (joint,) = certificate.joints
        assert joint.kept[0] == "rigid body"
        assert {"viscous", "coulomb", "offset", "stribeck"} <= set(joint.kept)
        assert joint.lost == ()
        # alike but for reversals, where the identifier knows the instant better than the sign of the velocity, and for
        # the payload's ratio
        assert joint.relative_error_export == pytest.approx(joint.relative_error_model, rel=0.2)
    assert (tmp_path / "arm.h").is_file()
    document = ExportedModelDocument.model_validate_json((tmp_path / "arm.json").read_text())
    assert [own.effect for own in document.torques] == ["viscous", "coulomb", "offset", "stribeck"]
    assert not [path.name for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_a_model_that_no_machine_can_be_is_exported_with_a_remark_in_file_and_certificate(plant, tmp_path):
    """A drive gain of the wrong sign: the estimate has a negative inertia, and its friction is held at nothing."""
    (joint,) = plant.robot.joints
    reversed_drive = joint.model_copy(update={"drive_gain": -joint.drive_gain})
    robot = plant.robot.model_copy(update={"joints": (reversed_drive,)})
    result = identify(replace(plant, robot=robot), "usual")
    for name, shown in (("arm.c", "arm.h"), ("arm.py", "arm.py"), ("arm.st", "arm.st")):
        certificate = write_export(result, tmp_path / name)
        said = [remark for remark in certificate.remarks if "negative, which no mass" in remark]
        assert said
        assert f"Remark: {said[0]}." in (tmp_path / shown).read_text()


@pytest.mark.parametrize("name", ["arm.PY", "arm.FMU", "arm.Json", "arm.ST", "arm.URDF", "arm.XML"])
def test_an_ending_in_capitals_is_the_same_format(plant, tmp_path, name):
    result = identify(plant, "usual")
    plain = tmp_path / "plain" / f"arm.{name.partition('.')[2].lower()}"
    plain.parent.mkdir()
    expected, certificate = write_export(result, plain), write_export(result, tmp_path / name)
    assert certificate == expected.model_copy(update={"target": name})
    assert certificate.checked_with != "nothing"
    assert {path.name for path in tmp_path.iterdir()} == {"plain", name, f"{name}.certificate.json"}
    if not name.endswith("FMU"):
        assert (tmp_path / name).read_bytes() == plain.read_bytes()


def test_c_in_capitals_would_be_another_language(plant, tmp_path):
    with pytest.raises(InputError, match=r"compilers take \.C for C\+\+; write arm\.c"):
        write_export(identify(plant, "usual"), tmp_path / "arm.C")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("target", "folder"),
    [
        ("arm.py", "arm.py"),
        ("arm.urdf", "arm.urdf.certificate.json"),
        ("arm.c", "arm.h"),
        ('a".c', None),
        ("a" * 300 + ".py", None),
    ],
)
def test_a_target_that_cannot_be_written_is_refused_before_anything_is(plant, tmp_path, target, folder):
    if folder is not None:
        (tmp_path / folder).mkdir()
    with pytest.raises(InputError, match="is a folder" if folder else "include|cannot be written"):
        write_export(identify(plant, "usual"), tmp_path / target)
    assert [path.name for path in tmp_path.iterdir()] == ([folder] if folder else [])


@pytest.mark.parametrize("name", ["arm.c", "arm.fmu"])
def test_a_target_may_be_relative(plant, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    export(plant, Path(name))
    assert {name, f"{name}.certificate.json"} <= {path.name for path in tmp_path.iterdir()}


@pytest.mark.parametrize("linked", ["arm.py", "arm.py.certificate.json"])
def test_a_link_is_not_followed(plant, tmp_path, linked):
    """Its certificate would stand elsewhere, or what it leads to would be written over."""
    (tmp_path / "project").mkdir()
    (tmp_path / linked).symlink_to(tmp_path / "project" / "controller")
    with pytest.raises(InputError, match=r"is a link to .*controller; name the file itself"):
        export(plant, tmp_path / "arm.py")
    assert not list((tmp_path / "project").iterdir())


def test_what_is_no_file_is_not_written_over(plant, tmp_path):
    os.mkfifo(tmp_path / "arm.py")
    with pytest.raises(InputError, match=r"arm.py: is no file"):
        export(plant, tmp_path / "arm.py")


def test_a_full_disk_names_the_target_and_leaves_nothing(plant, tmp_path, monkeypatch):
    def full(self, *_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    result = identify(plant, "usual")
    monkeypatch.setattr("pathlib.Path.write_bytes", full)
    with pytest.raises(InputError, match=r"arm.py: cannot be written: No space left on device"):
        write_export(result, tmp_path / "arm.py")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("target", "there"), [("arm.urdf", "arm.urdf"), ("arm.c", "arm.h")])
def test_a_file_that_was_not_exported_is_not_written_over(plant, tmp_path, target, there):
    (tmp_path / there).write_text("the maker's own")
    with pytest.raises(InputError, match="was not exported by coulomb"):
        export(plant, tmp_path / target)
    assert (tmp_path / there).read_text() == "the maker's own"
    (tmp_path / there).write_text("")
    export(plant, tmp_path / target, "rigid")
    written = (tmp_path / target).read_text()
    export(plant, tmp_path / target, "usual")  # an export is written anew
    assert (tmp_path / target).read_text() != written
