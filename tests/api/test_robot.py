"""`coulomb robot`: from a URDF to the section of an experiment."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
import yaml

from identify.recording.experiment_file import Robot

URDF = """<robot name="arm">
  <link name="base"/>
  <link name="arm"><inertial><origin xyz="0.3 0 0"/><mass value="5"/>
    <inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="arm"/><origin xyz="0 0 0.5"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="10" velocity="2"/>
  </joint>
</robot>
"""


def coulomb(*arguments):
    return subprocess.run([sys.executable, "-m", "api", *map(str, arguments)], capture_output=True, text=True)


@pytest.fixture
def urdf(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text(URDF)
    return file


def test_the_section_printed_is_one_that_an_experiment_accepts(urdf):
    done = coulomb("robot", urdf)
    assert done.returncode == 0, done.stderr
    robot = Robot.model_validate(yaml.safe_load(done.stdout)["robot"])
    assert robot.joints[0].name == "shoulder"
    assert robot.joints[0].limits is not None
    assert "ZZ1R    kg m^2  shoulder: ZZ1 + Ia1" in done.stdout


def test_json_holds_robot_and_base_parameters_and_nothing_else_is_printed(urdf):
    document = json.loads(coulomb("robot", urdf, "--json").stdout)
    assert [row["name"] for row in document["base_parameters"]] == ["ZZ1R", "MX1", "MY1"]
    assert document["robot"]["gravity"] == pytest.approx([0.0, 0.0, -9.81])


def test_a_file_that_is_no_urdf_gives_one_line_and_status_2(tmp_path):
    file = tmp_path / "experiment.yaml"
    file.write_text("format: 1\n")
    done = coulomb("robot", file)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert str(file) in done.stderr
