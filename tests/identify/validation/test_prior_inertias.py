"""Base parameters by a file of the robot beside identified ones: worked out for a slide and a pendulum, by hand."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

from identify.dynamics.base_parameters import base_parameters
from identify.dynamics.geometry import Geometry
from identify.dynamics.payload import payload_parameters
from identify.recording.errors import InputError
from identify.recording.experiment_file import Joint, LinkBody, PriorBodies, Robot
from identify.results.identification import Parameter
from identify.validation.prior_inertias import compared_with_prior, prior_of_file

URDF = """<robot name="arm"><link name="base"/>
<link name="l1"><inertial><origin xyz="0.2 0 0"/><mass value="4"/>
<inertia ixx="0.02" iyy="0.09" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="99" velocity="9"/></joint></robot>"""

PENDULUM = Robot(
    gravity=(0.0, 0.0, -9.81), joints=(Joint(name="j1", type="revolute", alpha=np.pi / 2, drive_gain=1.0),)
)
LINK = LinkBody(mass=4.0, com=(0.2, 0.05, 0.0), inertia=(0.02, 0.0, 0.0, 0.09, 0.0, 0.1))


def parameter(name, value, std_robust=None):
    return Parameter(
        name=name,
        joint="j1",
        value=value,
        std=None,
        std_robust=std_robust,
        relative_std_percent=None,
        unit="kg m",
        grouping=None,
    )


def test_a_link_of_which_only_the_mass_is_stated_is_a_point_at_its_frame():
    assert payload_parameters(LinkBody(mass=2.5)).tolist() == [0.0] * 9 + [2.5]


def compared(parameters, remarks=()):
    base = base_parameters(Geometry.from_robot(PENDULUM))
    result = SimpleNamespace(fitted=SimpleNamespace(record=SimpleNamespace(body=SimpleNamespace(base=base))))
    prior = PriorBodies(source="arm.urdf", links=(LINK,), remarks=remarks)
    return compared_with_prior(result, parameters, prior)


def test_a_pendulum_has_by_its_file_the_inertia_about_its_axis_and_its_first_moments():
    comparison = compared([])
    by_file = {row.name: row.by_file for row in comparison.parameters}
    assert by_file == pytest.approx(
        {"ZZ1R": 0.1 + 4 * (0.2**2 + 0.05**2), "MX1": 4 * 0.2, "MY1": 4 * 0.05}, rel=1e-12
    )
    assert comparison.file == "arm.urdf"
    assert {row.name for row in comparison.parameters if row.rotor} == {"ZZ1R"}
    assert all(row.identified is None and row.deviations is None for row in comparison.parameters)
    assert comparison.remarks == (
        "the file knows no rotors: values by it lack the Ia that are grouped into them",
    )


def test_a_difference_is_counted_in_standard_deviations_of_the_estimate():
    rows = {
        row.name: row
        for row in compared(
            [parameter("MX1", 0.86, 0.03), parameter("MY1", 0.1, 0.0)], ("joints merged",)
        ).parameters
    }
    assert rows["MX1"].deviations == pytest.approx(2.0)
    assert rows["MX1"].identified == 0.86
    assert rows["MY1"].identified == 0.1
    assert rows["MY1"].deviations is None  # nothing is known of how certain it is


@pytest.mark.parametrize(("value", "far"), [(0.8 + 0.1, True), (0.8 - 0.1, True), (0.8 + 0.08, False)])
def test_what_lies_further_than_three_deviations_is_named_but_not_where_the_file_lacks_a_rotor(value, far):
    remarks = compared(
        [parameter("MX1", value, 0.03), parameter("ZZ1R", 5.0, 0.01)], ("joints merged",)
    ).remarks
    assert remarks[0] == "joints merged"
    named = [remark for remark in remarks if remark.startswith("identified differently by more than 3")]
    assert len(named) == far
    assert not far or ": MX1; masses" in named[0]


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF)
    return tmp_path / "arm.urdf"


def robot_like_the_file(**changes):
    joint = {"name": "shoulder", "type": "revolute", "alpha": -np.pi / 2, "drive_gain": 1.0, **changes}
    return Robot(gravity=(0.0, 0.0, -9.81), joints=(Joint(**joint),))


def test_the_links_of_the_robots_own_file_are_read_even_where_its_angles_are_a_turn_apart(arm):
    for turn in (0.0, 2 * np.pi, -2 * np.pi):
        for small in (0.0, 5e-5):
            prior = prior_of_file(arm, None, robot_like_the_file(alpha=-np.pi / 2 + turn + small))
            assert prior.source == "arm.urdf"
            assert [link.mass for link in prior.links] == [4.0]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"name": "elbow"}, "has the joints shoulder, the experiment elbow; name the --tip"),
        ({"type": "prismatic"}, "joint 'shoulder': type is revolute, in the experiment prismatic"),
        ({"d": 2e-4}, "joint 'shoulder': d is 0, in the experiment 0.0002; its inertias are in other frames"),
        ({"r": 2 * np.pi}, "joint 'shoulder': r is 0, in the experiment 6.28319"),
        ({"alpha": np.pi / 2}, "joint 'shoulder': alpha is -1.5708, in the experiment 1.5708"),
        ({"theta": 0.01}, "joint 'shoulder': theta is 0, in the experiment 0.01"),
    ],
)
def test_the_file_of_another_robot_is_refused_by_joint_and_field(arm, changes, said):
    with pytest.raises(InputError, match=f"arm.urdf: {re.escape(said)}"):
        prior_of_file(arm, None, robot_like_the_file(**changes))


def test_a_file_without_masses_gives_nothing_to_compare_with(arm):
    arm.write_text(re.sub("<inertial>.*?</inertial>", "", URDF, flags=re.DOTALL))
    with pytest.raises(InputError, match="states no mass of any link; there is nothing to compare with"):
        prior_of_file(arm, None, robot_like_the_file())
