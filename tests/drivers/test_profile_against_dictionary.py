"""Profiles against what makers' public EDS files say of the same objects (`published_objects.yaml`)."""

from pathlib import Path

import pytest
import yaml

from drivers.profile import load_profile
from drivers.profile_against_dictionary import mismatches

PUBLISHED = yaml.safe_load(Path(__file__).with_name("published_objects.yaml").read_text(encoding="utf-8"))
TYPES = {"int8": 2, "int16": 3, "int32": 4, "uint8": 5, "uint16": 6, "uint32": 7}


def address(key: int | str) -> tuple[int, int]:
    """Index and subindex of `0x60C2.01` or of a plain index."""
    if isinstance(key, int):
        return key, 0
    index, _, subindex = key.partition(".")
    return int(index, 16), int(subindex, 16)


def as_eds(objects: dict) -> str:
    """An EDS that says what the maker's file says of these objects."""
    sections = ["[DeviceInfo]", "VendorName=of the maker", "[1000]", "DataType=7", "AccessType=ro"]
    for key, (kind, access, mapping, *_) in objects.items():
        index, subindex = address(key)
        if subindex:
            sections += [f"[{index:04X}]", "ObjectType=9", f"[{index:04X}sub{subindex:X}]"]
        else:
            sections += [f"[{index:04X}]", "ObjectType=7"]
        sections += [f"DataType={TYPES[kind]}", f"AccessType={access}"]
        sections += [f"PDOMapping={int(mapping == 'mappable')}"]
    return "\n".join(sections)


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_profile_says_of_its_objects_what_the_maker_s_eds_says(tmp_path, name):
    published = PUBLISHED[name]
    said = {address(key): facts for key, facts in published["objects"].items()}
    profile = load_profile(name)
    used = [profile.position, profile.current_reference, profile.rated, profile.temperature]
    for reference in filter(None, used):
        assert said[reference.index, reference.subindex][0] == reference.type
        assert reference.index not in published["absent"]
    assert profile.vendor_id == published["vendor"]
    eds = tmp_path / "maker.eds"
    eds.write_text(as_eds(published["objects"]))
    assert mismatches(profile.model_copy(update={"object_dictionary": str(eds)}), 5) == ()


def test_the_reference_that_trinamic_forbids_in_a_pdo_would_be_refused_before_the_bus_is_touched(tmp_path):
    eds = tmp_path / "maker.eds"
    eds.write_text(as_eds(PUBLISHED["trinamic-tmcm1636"]["objects"]))
    profile = load_profile("trinamic-tmcm1636")
    demand = profile.current_reference.model_copy(update={"index": 0x6074})
    wrong = profile.model_copy(update={"object_dictionary": str(eds), "current_reference": demand})
    (said,) = mismatches(wrong, 5)
    assert "current_reference 0x6074:00" in said
    assert "may not be mapped" in said
