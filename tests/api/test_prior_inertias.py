"""`coulomb identify --robot FILE`: what was identified beside what the file of the robot states."""

import json
import re
import shutil

import numpy as np
import pinocchio as pin
import pytest
import typer
import yaml
from typer.testing import CliRunner

from api.commands import identify, import_
from identify.dynamics.urdf import read_urdf
from identify.recording import InputError, load_experiment

application = typer.Typer()
application.callback()(lambda: None)
import_.register(application)
identify.register(application)

ARM = """<robot name="arm"><link name="base"/>
<link name="l1"><inertial><origin xyz="0.2 0.03 0.01"/><mass value="4"/>
<inertia ixx="0.02" iyy="0.09" izz="0.1" ixy="0.01" ixz="0" iyz="0"/></inertial></link>
<link name="l2"><inertial><origin xyz="0.15 -0.02 0"/><mass value="{mass}"/>
<inertia ixx="0.01" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="99" velocity="9"/></joint>
<joint name="elbow" type="revolute"><origin xyz="0.4 0 0"/><parent link="l1"/><child link="l2"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="99" velocity="9"/></joint></robot>"""


def run(*arguments):
    """A command in this process."""
    return CliRunner().invoke(application, [str(each) for each in arguments])


@pytest.fixture(scope="module")
def experiment(tmp_path_factory):
    """A record of the arm with a forearm of 2 kg, torques by Pinocchio with a little noise."""
    folder = tmp_path_factory.mktemp("prior")
    (folder / "arm.urdf").write_text(ARM.format(mass=2.0))
    model = pin.buildModelFromXML(ARM.format(mass=2.0))
    data = model.createData()
    time = np.arange(6000) / 500
    rates = np.array([[2.1, 3.7], [1.3, 4.9]])
    sizes = np.array([[0.7, 0.2], [0.8, 0.15]])
    phase = rates[:, :, None] * time
    q = (sizes[:, :, None] * np.sin(phase)).sum(axis=1).T
    dq = (sizes[:, :, None] * rates[:, :, None] * np.cos(phase)).sum(axis=1).T
    ddq = (-sizes[:, :, None] * rates[:, :, None] ** 2 * np.sin(phase)).sum(axis=1).T
    torque = np.array([pin.rnea(model, data, *sample) for sample in zip(q, dq, ddq, strict=True)])
    torque += np.random.default_rng(0).normal(scale=0.02, size=torque.shape)
    table = np.column_stack([time, q, torque])
    np.savetxt(folder / "log.csv", table, delimiter=",", header="t,q1,q2,v1,v2", comments="", fmt="%.12g")
    columns = ["--time", "t", "--position", "q1", "--position", "q2", "--command", "v1", "--command", "v2"]
    done = run(
        "import",
        folder / "log.csv",
        "--out",
        folder / "arm",
        *columns,
        "--command-unit",
        "Nm",
        "--robot",
        folder / "arm.urdf",
    )
    assert done.exit_code == 0, (done.exception, done.output)
    return folder / "arm"


def compared(experiment, file):
    done = run("identify", experiment, "--model", "rigid", "--robot", file, "--json")
    assert done.exit_code == 0, (done.exception, done.output)
    return json.loads(done.stdout)["prior"]


def test_the_right_file_agrees_within_its_deviations(experiment):
    prior = compared(experiment, experiment.parent / "arm.urdf")
    rows = {row["name"]: row for row in prior["parameters"]}
    moments = [row for name, row in rows.items() if name.startswith(("MX", "MY"))]
    assert len(moments) == 4
    for row in moments:
        assert row["identified"] == pytest.approx(row["by_file"], abs=0.02)
        assert not row["rotor"]
    assert any("knows no rotors" in remark for remark in prior["remarks"])
    assert not any("standard deviations" in remark for remark in prior["remarks"])


def test_a_forearm_that_is_lighter_in_the_file_is_named(experiment, tmp_path):
    (tmp_path / "light.urdf").write_text(ARM.format(mass=1.0))
    prior = compared(experiment, tmp_path / "light.urdf")
    rows = {row["name"]: row for row in prior["parameters"]}
    assert rows["MX2"]["by_file"] == pytest.approx(0.15)
    assert rows["MX2"]["identified"] == pytest.approx(0.30, abs=0.01)
    assert rows["MX2"]["deviations"] > 3
    (remark,) = [remark for remark in prior["remarks"] if "standard deviations" in remark]
    assert "MX2" in remark


def test_the_tables_hold_it(experiment):
    done = run("identify", experiment, "--model", "rigid", "--robot", experiment.parent / "arm.urdf")
    assert "By the bodies in" in done.stdout


def test_what_the_robot_was_imported_with_is_compared_without_the_option(experiment):
    by_file = compared(experiment, experiment.parent / "arm.urdf")
    plain = run("identify", experiment, "--model", "rigid", "--json")
    kept = json.loads(plain.stdout)["prior"]
    assert kept["file"] == "arm.urdf"
    assert kept["remarks"] == by_file["remarks"]
    for row, same in zip(kept["parameters"], by_file["parameters"], strict=True):
        assert row["by_file"] == pytest.approx(same["by_file"], abs=1e-12)
        assert row["identified"] == same["identified"]


def test_a_file_given_with_a_further_session_is_kept_too(experiment, tmp_path):
    (tmp_path / "log.csv").write_bytes((experiment.parent / "log.csv").read_bytes())
    (tmp_path / "light.urdf").write_text(ARM.format(mass=1.0))
    shutil.copytree(experiment, tmp_path / "arm")
    more = ("--append", "--robot", tmp_path / "light.urdf")
    done = run("import", tmp_path / "log.csv", "--out", tmp_path / "arm", *more)
    assert done.exit_code == 0, (done.exception, done.output)
    prior = load_experiment(tmp_path / "arm").prior
    assert prior is not None
    assert (prior.source, prior.links[1].mass) == ("light.urdf", 1.0)


def test_bodies_that_are_not_one_for_each_joint_are_refused(experiment, tmp_path):
    settings = (experiment / "experiment.yaml").read_text()
    document = yaml.safe_load(settings)
    document["prior"]["links"].pop()
    (tmp_path / "experiment.yaml").write_text(yaml.safe_dump(document))
    with pytest.raises(InputError, match=r"line \d+: prior.links: has 1 bodies for 2 joints"):
        load_experiment(tmp_path)


def test_a_file_without_masses_leaves_nothing_to_compare(tmp_path, experiment):
    massless = re.sub("<inertial>.*?</inertial>", "", ARM, flags=re.DOTALL)
    (tmp_path / "thin.urdf").write_text(massless)
    assert read_urdf(tmp_path / "thin.urdf").prior("thin.urdf") is None
    done = run("identify", experiment, "--robot", tmp_path / "thin.urdf")
    assert "states no mass" in str(done.exception)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('xyz="0.4 0 0"', 'xyz="0.5 0 0"', "joint 'elbow': d is 0.5, in the experiment 0.4"),
        ('name="elbow"', 'name="wrist"', "has the joints shoulder, wrist, the experiment shoulder, elbow"),
        ('type="revolute"><origin', 'type="prismatic"><origin', "joint 'elbow': type is prismatic"),
    ],
)
def test_the_file_of_another_robot_is_refused_by_joint_and_field(experiment, tmp_path, old, new, words):
    (tmp_path / "other.urdf").write_text(ARM.format(mass=2.0).replace(old, new))
    done = run("identify", experiment, "--model", "rigid", "--robot", tmp_path / "other.urdf")
    assert isinstance(done.exception, InputError)
    assert words in str(done.exception)
