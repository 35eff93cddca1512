"""The rig file."""

from pathlib import Path

import numpy as np
import pytest
import yaml

import config
from daq.rig import Rig, rig_names
from identify.recording.errors import InputError


def simulated_rig_data() -> dict:
    rig = Rig.load("rx130l-joint3-simulated")
    return yaml.safe_load(yaml.safe_dump(rig.model_dump(mode="json")))


def write(folder: Path, data: dict) -> Path:
    path = folder / "rig.yaml"
    path.write_text(yaml.safe_dump(data))
    return path


@pytest.mark.parametrize("name", rig_names())
def test_every_rig_that_ships_can_be_loaded(name):
    rig = Rig.load(name)
    n = len(rig.robot.joints)
    assert rig.drive_gain.shape == rig.position_matrix.shape == (n, n)


def test_the_drive_gain_of_one_joint_is_the_product_of_equation_4():
    rig = Rig.load("rx130l-joint3-simulated")
    axis = rig.axes[0]
    np.testing.assert_allclose(rig.drive_gain, [[axis.gear_ratio * axis.torque_constant]])


def test_a_thousand_per_mille_of_the_rated_torque_are_the_current_that_gives_it():
    rig = Rig.load("rx130l-joint3-simulated")
    axis = rig.axes[0]
    motor_torque = axis.torque_constant * rig.command_scale[0] * 1000
    assert motor_torque == pytest.approx(axis.rated_torque)


def test_a_rig_must_state_what_its_drives_unit_of_command_needs(tmp_path):
    data = simulated_rig_data()
    data["axes"][0]["rated_torque"] = None
    with pytest.raises(InputError, match=r"axes\[0\].*rated_torque is missing"):
        Rig.load(write(tmp_path, data))


def test_joint_power_equals_motor_power_for_a_coupled_wrist(tmp_path):
    data = simulated_rig_data()
    data["robot"]["joints"] = [{"name": "j5"}, {"name": "j6"}]
    data["axes"] = [
        {**data["axes"][0], "joint": "j5", "node": 5, "torque_constant": 0.5},
        {**data["axes"][0], "joint": "j6", "node": 6, "torque_constant": 0.2},
    ]
    data["gear_matrix"] = [[45.0, 0.0], [32.0, 32.0]]
    rig = Rig.load(write(tmp_path, data))
    current = np.array([2.0, -3.0])
    joint_velocity = np.array([0.7, 0.4])
    motor_torque = np.array([0.5, 0.2]) * current
    motor_velocity = np.array([45 * 0.7, 32 * (0.7 + 0.4)])
    assert (rig.drive_gain @ current) @ joint_velocity == pytest.approx(motor_torque @ motor_velocity)
    motor_turns = motor_velocity / (2 * np.pi)
    counts = motor_turns * data["axes"][0]["encoder_counts"]
    np.testing.assert_allclose(rig.position_matrix @ counts, joint_velocity)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rig: rig.update(cycle=0.2), "cycle"),
        (lambda rig: rig.update(wheel=1), "wheel"),
        (lambda rig: rig["axes"][0].update(node=128), "axes[0].node"),
        (lambda rig: rig["axes"][0]["limits"].update(position=[1.0, -1.0]), "axes[0].limits.position"),
        (lambda rig: rig["axes"][0].update(joint="j4"), "axes must name one drive for each joint"),
        (lambda rig: rig["axes"][0].update(gear_ratio=0), "gear_ratio must not be 0"),
        (lambda rig: rig.update(simulated=None), "pacing"),
        (lambda rig: rig.update(gear_matrix=[[0.0]]), "gear_matrix"),
        (lambda rig: rig["payloads"].append({"name": "none", "mass": 1.0}), "payloads"),
        (
            lambda rig: rig.update(name="my rig"),
            "name: 'my rig': use letters without accents, digits, '_', '.' and '-'",
        ),
        (lambda rig: rig["axes"][0].update(joint="é3"), "axes[0].joint: 'é3': use letters without accents"),
        (lambda rig: rig["robot"]["joints"][0].update(name="a\n" * 9999), "robot.joints[0].name: 'a a a a"),
        (
            lambda rig: rig["payloads"].append({"name": "½", "mass": 1.0}),
            "name: '½': use letters without accents",
        ),
        (
            lambda rig: rig.update(safety_output={"path": "/dev/null", "write": "A"}),
            "safety_output.write: give bytes as pairs",
        ),
    ],
)
def test_a_wrong_rig_is_refused_in_one_line_that_names_file_and_field(tmp_path, change, words):
    data = simulated_rig_data()
    change(data)
    path = write(tmp_path, data)
    with pytest.raises(InputError) as refusal:
        Rig.load(path)
    message = str(refusal.value)
    assert message.startswith(str(path))
    assert words in message
    assert "\n" not in message
    assert len(message) < 1000
    assert "pattern" not in message


def test_an_unknown_rig_names_those_that_are_known():
    with pytest.raises(InputError, match="rx130l-joint3-simulated"):
        Rig.load("no-such-rig")


def test_a_file_that_is_no_yaml_is_refused_in_one_line(tmp_path):
    path = tmp_path / "rig.yaml"
    path.write_text("name: [")
    with pytest.raises(InputError, match="not valid YAML") as refusal:
        Rig.load(path)
    assert "\n" not in str(refusal.value)


def test_the_documented_example_of_a_real_rig_can_be_loaded(tmp_path):
    text = (Path(config.__file__).parent / "rigs" / "README.md").read_text(encoding="utf-8")
    path = tmp_path / "shoulder.yaml"
    path.write_text(text.partition("```yaml\n")[2].partition("```")[0], encoding="utf-8")
    rig = Rig.load(path)
    assert rig.bus.interface == "socketcan"
    np.testing.assert_allclose(rig.drive_gain, [[100.0 * 0.0538]])


OWN_DRIVE = """name: mine
object_dictionary: mine.eds
position: {index: 0x6064, type: int32, unit: count}
current_reference: {index: 0x6074, type: int16, scale: 0.001, unit: rated torque}
rated: {index: 0x6076, type: uint32, scale: 0.001, unit: N m}
"""
OWN_DICTIONARY = """[6064]
ParameterName=Position
DataType=0x0004
AccessType=ro
PDOMapping={mapping}
[6041]
ParameterName=Statusword
DataType=6
AccessType=ro
PDOMapping=1
"""


def own_drive(tmp_path, drive, mapping=1):
    """A rig in one folder, its drive's profile and EDS in another."""
    (tmp_path / "drives").mkdir()
    (tmp_path / "drives" / "mine.yaml").write_text(OWN_DRIVE)
    (tmp_path / "drives" / "mine.eds").write_text(OWN_DICTIONARY.format(mapping=mapping))
    (tmp_path / "rigs").mkdir()
    data = simulated_rig_data()
    data["axes"][0] |= {"drive": drive, "node": "0x03"}
    text = yaml.safe_dump(data).replace("node: '0x03'", "node: 0x03")
    path = tmp_path / "rigs" / "rig.YAML"
    path.write_text(text)
    return path


@pytest.mark.parametrize("drive", ["../drives/mine.yaml", "../drives/mine.eds"])
def test_a_drive_is_named_by_a_file_beside_the_rig_file(tmp_path, monkeypatch, drive):
    monkeypatch.chdir("/")
    rig = Rig.load(own_drive(tmp_path, drive))
    assert rig.axes[0].node == 3
    assert rig.profiles[0].name == "mine"
    assert Path(rig.profiles[0].object_dictionary).samefile(tmp_path / "drives" / "mine.eds")


def test_a_profile_that_contradicts_its_eds_is_named_before_the_bus_is_touched(tmp_path):
    with pytest.raises(
        InputError, match=r"axes\[0\]\.drive: position 0x6064:00 .* may not be mapped in mine\.eds"
    ):
        Rig.load(own_drive(tmp_path, "../drives/mine.yaml", mapping=0))


def test_a_drive_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match=r"other\.eds: there is no such file"):
        Rig.load(own_drive(tmp_path, "../drives/other.eds"))


@pytest.mark.parametrize("position", [(0.5, 0.5), (0.6, 0.5)])
def test_an_axis_whose_limits_leave_it_no_way_is_refused(position):
    (axis,) = Rig.load("rx130l-joint3-simulated").axes
    with pytest.raises(ValueError, match="must lie below the highest"):
        type(axis.limits).model_validate({**axis.limits.model_dump(), "position": position})


def test_all_axes_of_a_rig_send_their_feedforward_alike(tmp_path):
    data = simulated_rig_data()
    data["robot"]["joints"] = [{"name": "j5"}, {"name": "j6"}]
    data["axes"] = [
        {**data["axes"][0], "joint": "j5", "node": 5, "feedforward": "cyclic-torque"},
        {**data["axes"][0], "joint": "j6", "node": 6},
    ]
    with pytest.raises(InputError, match="feedforward must be the same for all axes"):
        Rig.load(write(tmp_path, data))
    data["axes"][1]["feedforward"] = "cyclic-torque"
    assert Rig.load(write(tmp_path, data)).held_over_the_bus
    data["supervision"] = {"torque_timeout": 1.5 * Rig.load(write(tmp_path, data)).cycle}
    with pytest.raises(InputError, match=r"torque_timeout: two cycles at least \(0\.\d+ s\)"):
        Rig.load(write(tmp_path, data))
