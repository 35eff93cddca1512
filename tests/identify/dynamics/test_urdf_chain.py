"""The chain read from a URDF file: bodies, places and limits as Pinocchio has them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from identify.dynamics.urdf_chain import carried_inertia, read_chain
from identify.recording.errors import InputError

ELBOW = """<robot name="r">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.1 -0.2 0.3" rpy="0.4 -0.5 0.6"/><mass value="2.5"/>
    <inertia ixx="0.11" ixy="0.01" ixz="-0.02" iyy="0.12" iyz="0.03" izz="0.13"/></inertial></link>
  <link name="camera"><inertial><origin xyz="0 0 0.02"/><mass value="0.4"/>
    <inertia ixx="1e-3" ixy="0" ixz="0" iyy="2e-3" iyz="0" izz="3e-3"/></inertial></link>
  <link name="flange"/>
  <link name="lower"><inertial><mass value="1.5"/>
    <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.04"/></inertial></link>
  <joint name="waist" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0.6 0.8"/>
    <origin xyz="0 0 0.5" rpy="0.1 0.2 0.3"/><limit lower="-1.5" upper="2" effort="1" velocity="3"/></joint>
  <joint name="screws" type="fixed"><parent link="upper"/><child link="camera"/>
    <origin xyz="0.3 0.1 -0.2" rpy="-1 0.7 2"/></joint>
  <joint name="bolts" type="fixed"><parent link="upper"/><child link="flange"/>
    <origin xyz="0.5 0 0" rpy="0 1.2 0"/></joint>
  <joint name="elbow" type="prismatic"><parent link="flange"/><child link="lower"/><axis xyz="0 0 2"/>
    <origin xyz="0 0.1 0" rpy="0 0 -0.4"/><limit lower="0.2" upper="0.1" effort="1" velocity="0"/></joint>
</robot>"""


def about_the_origin(body: pin.Inertia) -> NDArray[np.float64]:
    """(10,) XX .. ZZ about the frame's origin, first moments, mass, of Pinocchio's body about its centre."""
    cross = pin.skew(body.lever)
    tensor = body.inertia - body.mass * cross @ cross
    return np.concatenate([tensor[np.triu_indices(3)], body.mass * body.lever, [body.mass]])


@pytest.fixture
def elbow(tmp_path: Path) -> Path:
    file = tmp_path / "elbow.urdf"
    file.write_text(ELBOW)
    return file


def test_bodies_and_places_are_pinocchios_what_is_fixed_carried_along(elbow):
    chain, remarks = read_chain(elbow)
    model = pin.buildModelFromXML(ELBOW)
    assert [joint.name for joint in chain] == list(model.names)[1:]
    assert [joint.type for joint in chain] == ["revolute", "prismatic"]
    for index, joint in enumerate(chain, start=1):
        np.testing.assert_allclose(joint.placement, model.jointPlacements[index].homogeneous, atol=1e-15)
        np.testing.assert_allclose(joint.inertia, about_the_origin(model.inertias[index]), atol=1e-14)
    np.testing.assert_allclose([joint.axis for joint in chain], [[0, 0.6, 0.8], [0, 0, 1]])
    assert remarks == ()


def test_a_limit_that_is_none_is_none(elbow):
    waist, slide = read_chain(elbow)[0]
    assert (waist.position_limits, waist.speed_limit) == ((-1.5, 2.0), 3.0)
    assert (slide.position_limits, slide.speed_limit) == (None, None)  # upper below lower; a speed of 0


def test_a_body_in_an_outer_frame_is_pinocchios_action():
    random = np.random.default_rng(3)
    body, place = pin.Inertia.Random(), pin.SE3(pin.exp3(random.normal(size=3)), random.normal(size=3))
    carried = carried_inertia(place.homogeneous, about_the_origin(body))
    np.testing.assert_allclose(carried, about_the_origin(place.act(body)), atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('parent link="flange"', 'parent link="flunge"', "joint 'elbow': its parent link 'flunge' does not"),
        ('<child link="camera"/>', '<child link="lower"/>', "link 'lower' hangs on two joints; a URDF is a tree"),
        ('<link name="base"/>', '<link name="base"/><link name="lost"/>', "found 'base', 'lost'"),
        ('axis xyz="0 0 2"', 'axis xyz="0 0 1e-12"', "joint 'elbow': its axis has no length"),
        ('type="prismatic"', 'type="planar"', "joint 'elbow': type 'planar': only revolute"),
        ('<mass value="1.5"/>', '<mass value="heavy"/>', "'lower': value=\"heavy\" must be a number"),
        ('rpy="0 0 -0.4"', 'rpy="0 0"', "'elbow': rpy=\"0 0\" must be 3 numbers"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_with_its_element(elbow, old, new, words):
    assert ELBOW.count(old) == 1
    elbow.write_text(ELBOW.replace(old, new))
    with pytest.raises(InputError, match=words) as refusal:
        read_chain(elbow)
    assert str(refusal.value).startswith(f"{elbow}: ")


def test_a_tip_that_does_not_exist_or_moves_not_at_all_is_refused(elbow):
    with pytest.raises(InputError, match="there is no link 'hand' to be the tip"):
        read_chain(elbow, tip="hand")
    with pytest.raises(InputError, match="no revolute, continuous or prismatic joint between base and tip"):
        read_chain(elbow, tip="base")
    chain, _ = read_chain(elbow, tip="camera")
    assert [joint.name for joint in chain] == ["waist"]
    assert chain[0].inertia[9] == pytest.approx(2.5 + 0.4 + 1.5)  # the elbow taken as fixed at zero
