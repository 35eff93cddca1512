import pytest
from pydantic import ValidationError

from drivers.cia402 import Mode, State
from drivers.drive import Drive
from drivers.errors import DriverError
from drivers.object_dictionary import (
    ObjectDictionaryError,
    load_object_dictionary,
    own_dictionary,
)
from drivers.profile import GENERIC, DriveProfile, ProfileError, load_profile, profile_names


@pytest.mark.parametrize("name", profile_names())
def test_every_profile_that_comes_with_the_software_says_where_its_objects_are_from(name):
    profile = load_profile(name)
    assert profile.name == name
    assert profile.manuals
    for reference in (profile.position, profile.current_reference, profile.rated, profile.temperature):
        assert reference is None or reference.source
    dictionary = load_object_dictionary(profile.object_dictionary, 5)
    assert dictionary[0x1000].default == 0x00020192


@pytest.mark.parametrize(
    ("name", "command", "rated"),
    [
        ("zeroerr-erob", 0x6074, 2.5),
        ("synapticon-somanet", 0x6074, 2.5),
        ("eyou-joint", 0x6074, None),
        ("faulhaber-mc3", 0x6077, None),
        ("kollmorgen-akd", 0x6077, None),
        ("trinamic-tmcm1636", 0x6077, None),
    ],
)
def test_a_profile_of_standard_objects_is_mapped_enabled_and_scaled_on_a_simulated_drive(
    open_bench, axis, name, command, rated
):
    bench = open_bench(axis(rated_torque=2.5))
    drive = Drive(bench.network, 5, load_profile(name))
    drive.produce_heartbeat(0.05)
    stream = drive.map_stream(Mode.CYCLIC_SYNCHRONOUS_POSITION)
    assert [(entry.name, entry.index) for pdo in stream.transmit for entry in pdo.entries] == [
        ("position", 0x6064),
        ("command", command),
        ("statusword", 0x6041),
    ]
    assert drive.rated_value() == (None if rated is None else pytest.approx(rated))
    drive.set_nmt_state("OPERATIONAL")
    drive.set_mode(Mode.CYCLIC_SYNCHRONOUS_POSITION)
    drive.enable()
    assert drive.state() is State.OPERATION_ENABLED


def test_the_generic_profile_is_torque_demand_in_per_mille_of_rated_torque():
    assert (GENERIC.current_reference.index, GENERIC.current_reference.scale) == (0x6074, 1e-3)
    assert GENERIC.rated is not None
    assert (GENERIC.rated.index, GENERIC.rated.unit) == (0x6076, "N m")


@pytest.mark.parametrize("name", ["generic-cia402.eds", "simulated.eds"])
def test_node_ids_are_in_the_cob_ids_of_the_object_dictionary(name):
    dictionary = load_object_dictionary(name, 5)
    assert dictionary[0x1400][1].default == 0x205
    assert dictionary[0x1800][1].default & 0x7FF == 0x185
    assert dictionary[0x1014].default == 0x85


def test_a_profile_that_is_not_there_is_told_with_those_that_are():
    with pytest.raises(ProfileError, match=r"'epos9' is not known; there are .*generic-cia402, .*simulated"):
        load_profile("epos9")


GOOD = """
name: mine
position: {index: 0x6064, type: int32, unit: count}
current_reference: {index: 0x30D0, type: int32, scale: 0.001, unit: A, sign: -1}
"""


def test_a_user_s_own_profile_is_read_from_its_path(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(GOOD)
    profile = load_profile(path)
    assert (profile.current_reference.index, profile.current_reference.sign) == (0x30D0, -1)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("type: int32, unit: count", "type: int33, unit: count", r"mine\.yaml: position\.type"),
        ("unit: A", "unit: mA", r"mine\.yaml: current_reference\.unit"),
        ("unit: count", "unit: A", r"mine\.yaml: position: .*raw is what is recorded"),
        (
            "unit: A, sign: -1}",
            "unit: A}\nrated: {index: 0x6076, type: uint32, unit: N m}",
            r"mine\.yaml: rated is for a current_reference in rated current or rated torque",
        ),
        (
            "unit: A, sign: -1}",
            "unit: rated torque}\nrated: {index: 0x6075, type: uint32, unit: A}",
            r"mine\.yaml: rated must be in N m",
        ),
        ("name: mine", "nme: mine", r"mine\.yaml: name"),
        ("index: 0x30D0", "index: 0x30", r"mine\.yaml: current_reference\.index"),
        (GOOD, "- 1\n- 2", "a drive profile is a mapping"),
        (GOOD, "a: [", r"mine\.yaml: not YAML"),
    ],
)
def test_a_wrong_profile_is_refused_in_one_line_that_names_file_and_field(tmp_path, old, new, words):
    path = tmp_path / "mine.yaml"
    path.write_text(GOOD.replace(old, new))
    with pytest.raises(ProfileError, match=words) as raised:
        load_profile(path)
    assert "\n" not in str(raised.value)


def test_a_profile_file_that_is_not_there_is_named():
    with pytest.raises(ProfileError, match=r"no/such\.yaml: No such file"):
        load_profile("no/such.yaml")


def test_a_profile_in_python_is_checked_likewise():
    amperes = GENERIC.current_reference.model_copy(update={"unit": "A"})
    with pytest.raises(ValidationError, match="rated is for a current_reference in rated"):
        DriveProfile(name="x", position=GENERIC.position, current_reference=amperes, rated=GENERIC.rated)


def test_an_object_dictionary_that_is_not_there_or_is_none_is_named(tmp_path):
    with pytest.raises(ObjectDictionaryError, match=r"'epos9\.eds': there is no such file"):
        load_object_dictionary("epos9.eds", 1)
    wrong = tmp_path / "wrong.eds"
    wrong.write_text("[FileInfo]\nFileName=wrong.eds\n")
    with pytest.raises(DriverError, match=r"wrong\.eds"):
        load_object_dictionary(wrong, 1)
    with pytest.raises(ObjectDictionaryError, match="there is no such file"):
        load_object_dictionary("../drives/simulated.eds", 1)


@pytest.mark.parametrize("drive", ["drive.xdd", "./drive.ccx"])
def test_a_file_of_another_kind_is_refused_with_those_that_are_read(drive):
    with pytest.raises(
        ProfileError, match=r"a file of your own is a profile \(\.yaml, \.yml\), an EDS or a DCF"
    ):
        load_profile(drive)


@pytest.mark.parametrize("name", ["simulated", "nanotec-pd4"])
def test_a_dictionary_that_comes_with_the_software_is_no_drive_s_own(name):
    assert own_dictionary(load_profile(name).object_dictionary, 1) is None
