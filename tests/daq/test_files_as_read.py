"""The files that a session is made from: which of them are others by now."""

import shutil

import pytest
import yaml

from daq.files_as_read import FilesAsRead, drive_digests, rig_as_read
from daq.rig import RIGS, Rig
from drivers.profile import profile_files

ARM = "rx130l-joint3-simulated"
DRIVES = RIGS.parent / "drives"


@pytest.fixture
def rig_file(tmp_path):
    """A rig whose drive is described by a profile and an EDS of the user's own."""
    document = yaml.safe_load((RIGS / f"{ARM}.yaml").read_text())
    (profile,) = {axis["drive"] for axis in document["axes"]}
    own = yaml.safe_load((DRIVES / f"{profile}.yaml").read_text())
    shutil.copy(DRIVES / own.get("object_dictionary", "generic-cia402.eds"), tmp_path / "own.eds")
    (tmp_path / "own.yaml").write_text(yaml.safe_dump(own | {"object_dictionary": "own.eds"}))
    document["axes"][0]["drive"] = "own.yaml"
    file = tmp_path / "arm.yaml"
    file.write_text(yaml.safe_dump(document))
    return file


def test_a_rig_is_made_from_its_file_its_drives_profiles_and_their_dictionaries(rig_file):
    rig, files = rig_as_read(rig_file)
    assert rig == Rig.load(rig_file)
    assert {file.name for file in files.digests} == {"arm.yaml", "own.yaml", "own.eds"}
    assert files.change() == ""


@pytest.mark.parametrize("name", ["arm.yaml", "own.yaml", "own.eds"])
def test_each_of_them_is_named_once_it_is_another(rig_file, name):
    _, files = rig_as_read(rig_file)
    changed = rig_file.with_name(name)
    content = changed.read_bytes()
    changed.write_bytes(content + b"\n")
    assert files.change() == f"{changed} was changed"
    changed.write_bytes(content)  # the same again is no change, whenever it was written
    assert files.change() == ""
    changed.unlink()
    assert files.change() == f"{changed} was removed"


def test_files_of_the_software_are_found_by_the_name_of_a_rig():
    _, files = rig_as_read(ARM)
    assert RIGS / f"{ARM}.yaml" in files.digests
    assert None not in files.digests.values()
    assert len(files.digests) >= 2


def test_several_sets_of_files_are_one(tmp_path):
    first, second = tmp_path / "a", tmp_path / "b"
    first.write_text("1")
    files = FilesAsRead.of([first]) | FilesAsRead.of([second])
    assert files.change() == ""
    first.write_text("2")
    second.write_text("3")
    assert files.change() == f"{first} was changed and {second} was changed"


def test_what_a_drive_says_is_compared_and_not_how_it_is_written(rig_file):
    before = drive_digests(Rig.load(rig_file))
    profile = rig_file.with_name("own.yaml")
    profile.write_text("# a comment\n" + profile.read_text())
    assert drive_digests(Rig.load(rig_file)) == before
    own = yaml.safe_load(profile.read_text())
    own["current_reference"]["sign"] = -own["current_reference"].get("sign", 1)
    profile.write_text(yaml.safe_dump(own))
    assert drive_digests(Rig.load(rig_file)) != before


@pytest.mark.parametrize("drive", ["generic-cia402", str(DRIVES / "generic-cia402.eds")])
def test_the_generic_profile_has_no_file_but_its_dictionary(drive):
    assert [file.name for file in profile_files(drive)] == ["generic-cia402.eds"]
