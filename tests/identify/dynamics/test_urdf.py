"""Robots read from URDF files against Pinocchio's own reader, and files that are not a serial robot."""

from __future__ import annotations

import os
import random
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.dynamics.geometry import Geometry, nominal_angles
from identify.dynamics.regressor import standard_regressor
from identify.dynamics.urdf import read_urdf, write_urdf
from identify.recording.errors import InputError
from tests.identify.dynamics.random_robots import random_motion

right_angles = st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi, 1.5708])
angles = st.one_of(right_angles, st.floats(-3.0, 3.0).filter(lambda angle: abs(np.sin(2 * angle)) > 1e-3))
lengths = st.one_of(st.just(0.0), st.floats(0.02, 0.8), st.floats(-0.8, -0.02))
oblique = st.tuples(*[st.integers(-9, 9)] * 3).filter(any).map(lambda axis: " ".join(map(str, axis)))
axes = st.one_of(st.sampled_from(["0 0 1", "0 0 -1", "1 0 0", "0 -1 0", "0 1 0"]), oblique)
placements = st.tuples(lengths, lengths, lengths, angles, angles, angles)
kinds = st.sampled_from(["revolute", "revolute", "continuous", "prismatic", "fixed"])
elements = st.lists(st.tuples(kinds, placements, axes), min_size=1, max_size=8).filter(
    lambda chain: any(kind != "fixed" for kind, _, _ in chain)
)


def urdf_text(chain, seed):
    """A URDF of a chain with random inertias; some links carry a fixed attachment beside."""
    generator = np.random.default_rng(seed)
    text = ["<robot name='random'>", "<link name='base'/>"]
    parent = "base"
    for k, (kind, placement, axis) in enumerate(chain):
        text += [
            link_text(f"link{k}", generator),
            joint_text(f"joint{k}", kind, parent, f"link{k}", placement, axis),
        ]
        if generator.random() < 0.3:
            beside = tuple(generator.uniform(-1, 1, 6))
            text += [link_text(f"sensor{k}", generator)]
            text += [joint_text(f"screws{k}", "fixed", f"link{k}", f"sensor{k}", beside, "1 0 0")]
        parent = f"link{k}"
    return "\n".join([*text, "</robot>"])


def link_text(name, generator):
    root = generator.normal(size=(3, 3))
    tensor = root @ root.T
    centre = " ".join(map(repr, generator.uniform(-0.3, 0.3, 3).tolist()))
    turn = " ".join(map(repr, generator.uniform(-1, 1, 3).tolist()))
    entries = " ".join(
        f"i{'xyz'[i]}{'xyz'[j]}='{float(tensor[i, j])!r}'" for i in range(3) for j in range(i, 3)
    )
    return (
        f"<link name='{name}'><inertial><origin xyz='{centre}' rpy='{turn}'/>"
        f"<mass value='{generator.uniform(0.5, 9)!r}'/><inertia {entries}/></inertial></link>"
    )


def joint_text(name, kind, parent, child, placement, axis):
    xyz, rpy = (" ".join(repr(float(value)) for value in part) for part in (placement[:3], placement[3:]))
    limit = "" if kind == "fixed" else "<limit lower='-2' upper='2' effort='9' velocity='3'/>"
    return (
        f"<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>"
        f"<origin xyz='{xyz}' rpy='{rpy}'/><axis xyz='{axis}'/>{limit}</joint>"
    )


def pinocchio_torques(text, q, dq, ddq):
    """Inverse dynamics by Pinocchio of the same file; its continuous joints hold cosine and sine."""
    model = pin.buildModelFromXML(text)
    data = model.createData()
    torques = []
    for position, velocity, acceleration in zip(q, dq, ddq, strict=True):
        configuration = []
        for joint, value in zip(model.joints[1:], position, strict=True):
            configuration += [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
        torques.append(pin.rnea(model, data, np.array(configuration), velocity, acceleration))
    return np.array(torques)


@settings(max_examples=60, deadline=None)
@given(elements, st.integers(0, 2**32 - 1))
def test_a_random_urdf_has_the_torques_of_pinocchios_reading(tmp_path_factory, chain, seed):
    exact = [
        (kind, tuple(np.pi / 2 if v == 1.5708 else v for v in place), axis) for kind, place, axis in chain
    ]
    file = tmp_path_factory.mktemp("urdf") / "robot.urdf"
    file.write_text(urdf_text(chain, seed))
    found = read_urdf(file)
    n = len(found.robot.joints)
    motion = random_motion(seed, 4, n)
    ours = standard_regressor(Geometry.from_robot(found.robot), *motion) @ found.standard
    reference = pinocchio_torques(urdf_text(exact, seed), *motion)
    assert np.abs(ours - reference).max() < 1e-9 * np.abs(reference).max()


@settings(max_examples=25, deadline=None)
@given(elements, st.integers(0, 2**32 - 1))
def test_a_written_robot_has_the_torques_of_the_one_it_was_written_from(tmp_path_factory, chain, seed):
    folder = tmp_path_factory.mktemp("urdf")
    (folder / "given.urdf").write_text(urdf_text(chain, seed))
    given_robot = read_urdf(folder / "given.urdf")
    write_urdf(folder / "written.urdf", given_robot.robot, given_robot.standard)
    n = len(given_robot.robot.joints)
    motion = random_motion(seed, 4, n)
    geometry = Geometry.from_robot(given_robot.robot)
    ours = standard_regressor(geometry, *motion) @ given_robot.standard
    model = pin.buildModelFromXML((folder / "written.urdf").read_text())
    assert model.nv == n
    text = (folder / "written.urdf").read_text()
    again = read_urdf(folder / "written.urdf", gravity=given_robot.robot.gravity)
    reread = standard_regressor(Geometry.from_robot(again.robot), *motion) @ again.standard
    angles = [float(angle) for three in re.findall(r'rpy="([^"]*)"', text) for angle in three.split()]
    # a written angle that is a right one but for some 1e-5 is read as the right one
    bound = 1e-9 if np.allclose(nominal_angles(angles), angles, rtol=0, atol=1e-12) else 1e-4
    assert np.abs(reread - ours).max() < bound * np.abs(ours).max()
    if given_robot.robot.gravity == (0.0, 0.0, -9.81):
        reference = pinocchio_torques(text, *motion)
        assert np.abs(ours - reference).max() < 1e-9 * np.abs(reference).max()


@pytest.fixture
def elbow(tmp_path):
    """Two joints: one about z at a height, one about y at the end of an arm along x."""
    generator = np.random.default_rng(0)
    text = [
        "<robot name='elbow'><link name='base'/>",
        link_text("upper", generator),
        link_text("lower", generator),
        joint_text("waist", "revolute", "base", "upper", (0, 0, 0.4, 0, 0, 0), "0 0 1"),
        joint_text("elbow", "continuous", "upper", "lower", (0.3, 0, 0, 0, 0, 0), "0 1 0"),
        "</robot>",
    ]
    file = tmp_path / "elbow.urdf"
    file.write_text("\n".join(text))
    return file


def test_a_robot_on_frames_like_ours_keeps_its_base_and_its_numbers(elbow):
    found = read_urdf(elbow, drive_gains=[10.0, 20.0])
    waist, joint = found.robot.joints
    np.testing.assert_array_equal(found.first_frame, np.eye(4))
    assert found.robot.gravity == (0.0, 0.0, -9.81)
    assert (waist.alpha, waist.d, waist.theta, waist.r) == (0.0, 0.0, 0.0, 0.4)
    assert (joint.alpha, joint.d, joint.theta, joint.r) == pytest.approx((-np.pi / 2, 0.3, 0.0, 0.0))
    assert [each.drive_gain for each in found.robot.joints] == [10.0, 20.0]


def test_limits_come_along_and_a_continuous_joint_has_none_on_position(elbow):
    waist, joint = read_urdf(elbow).robot.joints
    assert waist.limits is not None
    assert waist.limits.position == (-2.0, 2.0)
    assert joint.limits is not None
    assert joint.limits.position is None
    assert joint.limits.velocity == 3.0


def test_losses_are_written_where_they_were_identified(elbow, tmp_path):
    found = read_urdf(elbow)
    write_urdf(tmp_path / "out.urdf", found.robot, found.standard, damping=[1.5, 2.5], friction=[0.1, 0.2])
    assert '<dynamics damping="2.5" friction="0.2"/>' in (tmp_path / "out.urdf").read_text()


def test_a_link_without_mass_is_not_written(elbow, tmp_path):
    found = read_urdf(elbow)
    with pytest.raises(ValueError, match=r"link of joint 'waist': mass 0 kg must be above zero"):
        write_urdf(tmp_path / "out.urdf", found.robot, np.zeros(22))
    assert not (tmp_path / "out.urdf").exists()


def branch(file):
    generator = np.random.default_rng(1)
    finger = [
        link_text("finger", generator),
        joint_text("grip", "prismatic", "lower", "finger", (0.1, 0, 0, 0, 0, 0), "1 0 0"),
        link_text("thumb", generator),
        joint_text("grasp", "prismatic", "lower", "thumb", (0.1, 0.1, 0, 0, 0, 0), "1 0 0"),
        "</robot>",
    ]
    file.write_text(file.read_text().replace("</robot>", "\n".join(finger)))


def test_a_gripper_beyond_the_tip_is_carried_as_a_fixed_body(elbow):
    branch(elbow)
    found = read_urdf(elbow, tip="lower")
    assert [joint.name for joint in found.robot.joints] == ["waist", "elbow"]
    model = pin.buildModelFromXML(elbow.read_text())
    total = sum(inertia.mass for inertia in model.inertias)
    assert found.standard[[9, 20]].sum() == pytest.approx(total)


LOOP = """<link name='x'/><link name='y'/>
<joint name='r1' type='fixed'><parent link='y'/><child link='x'/></joint>
<joint name='r2' type='fixed'><parent link='x'/><child link='y'/></joint></robot>"""


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text[:200], "is not XML"),
        (lambda text: "<model/>", "must be <robot> .*, not <model>"),
        (lambda text: text.replace("continuous", "floating"), "joint 'elbow': type 'floating'"),
        (
            lambda text: text.replace("link='upper'/><child", "link='uper'/><child"),
            "parent link 'uper' does not exist",
        ),
        (lambda text: text.replace("0 1 0", "0 0 0"), "joint 'elbow': its axis has no length"),
        (lambda text: text.replace("'elbow'", "'waist'"), "2 joints are called 'waist'; names must differ"),
        (lambda text: text.replace("</robot>", "<link name='upper'/></robot>"), "2 links are called 'upper'"),
        (lambda text: text.replace("</robot>", "<link/></robot>"), "a <link> has no name"),
        (lambda text: text.replace("mass value='", "mass value='-"), "mass -.* kg must not be negative"),
        (lambda text: text.replace("</robot>", LOOP), "joint 'r1': the links form a loop"),
        (lambda text: text.replace("0 1 0", "0 one 0"), "must be 3 numbers"),
        (lambda text: text.replace("0 1 0", "0 1e200 0"), "beyond 1e\\+12, which no robot has"),
        (
            lambda text: text.replace("'elbow'", "'\u202ewoble'"),
            "joint ' woble': name: holds the character U\\+202E",
        ),
        (
            lambda text: text.replace("'elbow'", f"'{'e' * 300}'"),
            "joint 'e{80}': name: .* at most 255 characters",
        ),
        (lambda text: text.replace("link='lower'/><origin", "link='upper'/><origin"), "hangs on two joints"),
        (
            lambda text: text.replace("<axis xyz='0 1 0'/>", "<axis xyz='0 1 0'/><mimic joint='waist'/>"),
            "joint 'elbow': it mimics",
        ),
        (
            lambda text: text.replace("continuous", "fixed").replace("revolute", "fixed"),
            "no revolute, continuous",
        ),
    ],
)
def test_a_file_that_is_no_serial_robot_is_refused_in_one_line(elbow, change, words):
    elbow.write_text(change(elbow.read_text()))
    with pytest.raises(InputError, match=words) as refused:
        read_urdf(elbow)
    assert str(refused.value).startswith(str(elbow))
    assert "\n" not in str(refused.value)


def long_chain(folder: Path, kinds: Sequence[str]) -> Path:
    """A chain of links with joints of these types."""
    links = "".join(f'<link name="l{k}"/>' for k in range(len(kinds) + 1))
    joints = "".join(
        f'<joint name="j{k}" type="{kind}"><parent link="l{k}"/><child link="l{k + 1}"/></joint>'
        for k, kind in enumerate(kinds)
    )
    (folder / "long.urdf").write_text(f'<robot name="r">{links}{joints}</robot>')
    return folder / "long.urdf"


def test_a_chain_of_very_many_links_is_read(tmp_path):
    urdf = long_chain(tmp_path, ["revolute"] * 3 + ["fixed"] * 1497)
    assert len(read_urdf(urdf).robot.joints) == 3


def test_a_chain_of_very_many_joints_is_refused_before_its_parameters_fill_the_memory(tmp_path):
    urdf = long_chain(tmp_path, ["continuous"] * 300)
    with pytest.raises(InputError, match="joints: 300 are given, at most 64"):
        read_urdf(urdf)


def test_branching_joints_ask_for_the_tip(elbow):
    branch(elbow)
    with pytest.raises(InputError, match="name the tip link, one of 'finger', 'thumb'"):
        read_urdf(elbow)
    with pytest.raises(InputError, match="no link 'toe'"):
        read_urdf(elbow, tip="toe")


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_urdf(tmp_path / "absent.urdf")


FINGERS = """
  <link name="f1"><inertial><mass value="0.1"/></inertial></link><link name="f2"/>
  <joint name="g1" type="prismatic"><parent link="l6"/><child link="f1"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.1" effort="1" velocity="inf"/></joint>
  <joint name="g2" type="prismatic"><parent link="l6"/><child link="f2"/><axis xyz="-1 0 0"/>{mimic}
    <limit lower="0" upper="0.1" effort="1" velocity="1"/></joint>
"""


def arm(folder, fingers="", head='<robot name="r">', extra="", velocity="1"):
    """An arm of six joints, optionally with a gripper."""
    text = [head, extra, '<link name="l0"/>']
    for k in range(1, 7):
        text.append(f'<link name="l{k}"><inertial><mass value="1"/></inertial></link>')
        text.append(
            f'<joint name="j{k}" type="revolute"><parent link="l{k - 1}"/><child link="l{k}"/><origin xyz="0 0 0.2"/>'
            f'<axis xyz="0 {k % 2} {1 - k % 2}"/><limit lower="-1" upper="1" effort="-1" velocity="{velocity}"/></joint>'
        )
    path = folder / "arm.urdf"
    path.write_text("\n".join([*text, fingers, "</robot>"]))
    return path


@pytest.mark.parametrize(
    "options",
    [
        {"extra": '<gazebo reference="l1"><sensor:camera name="c"/></gazebo>'},
        {"head": '<robot name="r" xmlns="http://www.ros.org">'},
        {"head": '\n<?xml version="1.0"?>\n<robot name="r" xmlns:k="http://k">', "extra": "<k:note/>"},
        {"fingers": FINGERS.format(mimic="")},
        {"fingers": FINGERS.format(mimic='<mimic joint="g1"/>')},
    ],
)
def test_names_with_prefixes_and_grippers_are_no_obstacle(tmp_path, options):
    found = read_urdf(arm(tmp_path, **options))
    assert [joint.name for joint in found.robot.joints] == [f"j{k}" for k in range(1, 7)]
    assert found.standard.reshape(6, 11)[:, 9].sum() == pytest.approx(6.1 if "fingers" in options else 6)
    assert len(found.remarks) == ("fingers" in options)


@pytest.mark.parametrize(
    ("velocity", "limit", "remarks"), [("-1", None, 6), ("inf", None, 0), ("2.5", 2.5, 0)]
)
def test_a_speed_that_is_no_limit_is_none(tmp_path, velocity, limit, remarks):
    found = read_urdf(arm(tmp_path, velocity=velocity))
    assert {joint.limits.velocity for joint in found.robot.joints} == {limit}
    assert len(found.remarks) == remarks


def test_a_file_of_macros_says_how_to_expand_it(tmp_path):
    with pytest.raises(InputError, match="expand it first: xacro"):
        read_urdf(arm(tmp_path, extra='<xacro:include filename="x"/>'))


def test_a_damaged_file_is_read_or_refused_in_one_line(tmp_path):
    chance = random.Random(7)
    path = arm(tmp_path, FINGERS.format(mimic='<mimic joint="g1"/>'))
    whole = path.read_bytes()
    refused = []
    for _ in range(int(os.environ.get("COULOMB_FUZZED_FILES", "150"))):
        data = bytearray(whole)
        for _ in range(chance.choice((1, 2, 6))):
            place = chance.randrange(len(data))
            change = (b"", b"<", b">", b'"', b"-", b"x", b"9e999", b"nan", b"\xff", b"link", b"/", b" ")
            data[place : place + chance.randrange(0, 4)] = chance.choice(change)
        path.write_bytes(bytes(data))
        try:
            read_urdf(path)
        except InputError as error:
            refused.append(str(error))
    assert refused
    assert not [words for words in refused if "\n" in words]
