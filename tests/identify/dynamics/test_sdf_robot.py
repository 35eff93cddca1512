"""Robots read from SDF against the same robots as URDF, poses by Pinocchio; and what its own exporter writes."""

import xml.etree.ElementTree as ElementTree

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.dynamics.geometry import Geometry
from identify.dynamics.regressor import standard_regressor
from identify.dynamics.urdf import read_urdf
from identify.recording.errors import InputError
from tests.identify.dynamics.random_robots import random_motion
from tests.identify.dynamics.test_urdf import elements, urdf_text


def pose(placement, generator, **attributes):
    """A pose in one of SDFormat's three ways of writing it."""
    frame = pin.SE3(placement)
    stated = "".join(f' {key}="{value}"' for key, value in attributes.items())
    way = generator.integers(3)
    if way == 0:
        x, y, z, w = pin.Quaternion(frame.rotation).coeffs()
        values, stated = [*frame.translation, x, y, z, w], stated + ' rotation_format="quat_xyzw"'
    else:
        angles = pin.rpy.matrixToRpy(frame.rotation)
        if way == 1:
            angles, stated = np.rad2deg(angles), stated + ' degrees="true"'
        values = [*frame.translation, *angles]
    return f"<pose{stated}>{' '.join(repr(float(value)) for value in values)}</pose>"


def sdf_text(urdf, seed):
    """The robot of a URDF, its links' frames moved away from their joints at random, poses in frames chosen at random."""
    generator = np.random.default_rng(seed)
    model = pin.buildModelFromXML(urdf)
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    root = ElementTree.fromstring(urdf)
    at = {
        link.get("name"): data.oMf[model.getFrameId(link.get("name"))].homogeneous
        for link in root.findall("link")
    }
    moved = {name: pin.SE3.Random().homogeneous if name != "base" else np.eye(4) for name in at}
    links, joints = "", ""
    for link in root.findall("link"):
        name = link.get("name")
        place = at[name] @ moved[name]
        parent = next(
            (
                j.find("parent").get("link")
                for j in root.findall("joint")
                if j.find("child").get("link") == name
            ),
            None,
        )
        if parent is not None and generator.random() < 0.5:
            stated = pose(np.linalg.inv(at[parent] @ moved[parent]) @ place, generator, relative_to=parent)
        else:
            stated = pose(place, generator)
        inertial = link.find("inertial")
        body = ""
        if inertial is not None:
            origin = inertial.find("origin")
            angles = [float(v) for v in origin.get("rpy").split()]
            centre = pin.SE3(
                pin.rpy.rpyToMatrix(np.array(angles)), np.array([float(v) for v in origin.get("xyz").split()])
            )
            entries = "".join(
                f"<{key}>{value}</{key}>" for key, value in inertial.find("inertia").attrib.items()
            )
            body = (
                f"<inertial>{pose(np.linalg.inv(moved[name]) @ centre.homogeneous, generator)}"
                f"<mass>{inertial.find('mass').get('value')}</mass><inertia>{entries}</inertia></inertial>"
            )
        links += f'<link name="{name}">{stated}{body}</link>'
    for joint in root.findall("joint"):
        name, child = joint.get("name"), joint.find("child").get("link")
        parent = joint.find("parent").get("link")
        direction = np.array([float(v) for v in joint.find("axis").get("xyz").split()])
        if generator.random() < 0.5:
            place = pose(np.linalg.inv(moved[child]), generator)
        else:
            place = pose(np.linalg.inv(at[parent] @ moved[parent]) @ at[child], generator, relative_to=parent)
        stated = ""
        if generator.random() < 0.3:
            direction, stated = at[child][:3, :3] @ direction, ' expressed_in="__model__"'
        xyz = " ".join(repr(float(value)) for value in direction)
        joints += (
            f'<joint name="{name}" type="{joint.get("type")}">{place}<parent>{parent}</parent><child>{child}</child>'
            f"<axis><xyz{stated}>{xyz}</xyz><limit><lower>-2</lower><upper>2</upper><velocity>3</velocity></limit></axis></joint>"
        )
    return f'<sdf version="1.11"><model name="robot">{links}{joints}</model></sdf>'


@settings(max_examples=25, deadline=None)
@given(
    elements.filter(lambda chain: all(v != 1.5708 for _kind, place, _axis in chain for v in place)),
    st.integers(0, 2**32 - 1),
)
def test_the_same_robot_as_sdf_has_the_torques_of_the_urdf(tmp_path_factory, chain, seed):
    folder = tmp_path_factory.mktemp("sdf")
    text = urdf_text(chain, seed)
    (folder / "robot.urdf").write_text(text)
    pin.seed(seed % 2**31)
    (folder / "robot.sdf").write_text(sdf_text(text, seed))
    by_urdf, by_sdf = read_urdf(folder / "robot.urdf"), read_urdf(folder / "robot.sdf")
    assert [joint.name for joint in by_sdf.robot.joints] == [joint.name for joint in by_urdf.robot.joints]
    motion = random_motion(seed, 4, len(by_urdf.robot.joints))
    one, other = (
        standard_regressor(Geometry.from_robot(read.robot), *motion) @ read.standard
        for read in (by_urdf, by_sdf)
    )
    assert np.abs(other - one).max() < 1e-9 * np.abs(one).max()
    assert by_sdf.robot.joints[0].limits.velocity == 3.0


BODY = '<link name="a"/><link name="b"><inertial><mass>1</mass></inertial></link>'


@pytest.mark.parametrize(
    ("inside", "words"),
    [
        ("", "exactly one <model> with links is a robot, found none; keep the robot's alone in the file"),
        ("<include><uri>x</uri></include>", "found none; expand its <include> first: gz sdf -p FILE"),
        ('<link name="a"/><include><uri>x</uri></include>', "holds others by <include>"),
        (BODY + '<joint name="j" type="revolute"><parent>a</parent><child>c</child></joint>', "'c'"),
        (BODY + '<joint name="j" type="ball"><parent>a</parent><child>b</child></joint>', "type 'ball'"),
        (
            BODY
            + '<joint name="j" type="revolute"><pose>1 2</pose><parent>a</parent><child>b</child></joint>',
            "'j': pose '1 2' must be 6 numbers",
        ),
        (
            BODY
            + '<joint name="j" type="revolute"><pose relative_to="j">0 0 0 0 0 0</pose><parent>a</parent>'
            "<child>b</child></joint>",
            "'j': its pose is stated relative to itself",
        ),
        (BODY + '<joint name="j" type="screw"><parent>a</parent><child>b</child></joint>', "type 'screw'"),
    ],
)
def test_what_cannot_be_read_is_refused_in_one_line_that_names_it(tmp_path, inside, words):
    path = tmp_path / "robot.sdf"
    path.write_text(f'<sdf version="1.9"><model name="m">{inside}</model></sdf>')
    with pytest.raises(InputError) as refused:
        read_urdf(path)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_joint_to_the_world_and_limits_of_1e16_are_none(tmp_path):
    path = tmp_path / "robot.sdf"
    path.write_text(
        '<sdf version="1.7"><world name="w"><model name="m"><link name="a"><pose>0 0 1 0 0 0</pose></link>'
        '<link name="b"><inertial><mass>2</mass></inertial></link>'
        '<joint name="foot" type="fixed"><parent>world</parent><child>a</child></joint>'
        '<joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 1 0</xyz>'
        "<limit><lower>-1e16</lower><upper>1e16</upper><velocity>-1</velocity></limit></axis></joint></model></world></sdf>"
    )
    (joint,) = read_urdf(path).robot.joints
    assert joint.name == "j"
    assert joint.limits is None or (joint.limits.position is None and joint.limits.velocity is None)


def test_a_slow_joint_keeps_its_limit_of_speed(tmp_path):
    path = tmp_path / "robot.sdf"
    path.write_text(
        '<sdf version="1.7"><model name="m"><link name="a"/><link name="b"><inertial><mass>2</mass></inertial></link>'
        '<joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 1 0</xyz>'
        "<limit><lower>-2</lower><upper>2</upper><velocity>0.3</velocity></limit></axis></joint></model></sdf>"
    )
    (joint,) = read_urdf(path).robot.joints
    assert joint.limits.velocity == 0.3
