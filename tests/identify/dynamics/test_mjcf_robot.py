"""Robots read from MJCF against MuJoCo's own inverse dynamics."""

import random

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.dynamics.geometry import Geometry
from identify.dynamics.regressor import standard_regressor
from identify.dynamics.urdf import read_urdf
from identify.recording.errors import InputError

DEGREES = 180 / np.pi


def words(values):
    return " ".join(repr(float(value)) for value in values)


def unit(generator, size=3):
    values = generator.normal(size=size)
    return values / np.linalg.norm(values)


def orientation(generator, degrees, sequence):
    """An orientation in one of MJCF's five ways."""
    factor = DEGREES if degrees else 1.0
    way = generator.integers(6)
    if way == 0:
        return f'quat="{words(generator.normal(size=4))}"'
    if way == 1:
        return f'axisangle="{words([*unit(generator), generator.uniform(-3, 3) * factor])}"'
    if way == 2:
        return f'euler="{words(generator.uniform(-3, 3, 3) * factor)}"'
    if way == 3:
        return f'xyaxes="{words(generator.normal(size=6))}"'
    if way == 4:
        return f'zaxis="{words(unit(generator))}"'
    return ""


def inertial(generator, degrees, sequence):
    root = generator.normal(size=(3, 3))
    tensor = root @ root.T
    tensor = np.trace(tensor) * np.eye(3) - tensor  # what a body can have
    place = f'pos="{words(generator.uniform(-0.3, 0.3, 3))}" mass="{generator.uniform(0.5, 9)!r}"'
    if generator.random() < 0.5:
        full = [tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2]]
        return f'<inertial {place} fullinertia="{words(full)}"/>'
    diagonal = words(np.linalg.eigvalsh(tensor))
    return f'<inertial {place} diaginertia="{diagonal}" {orientation(generator, degrees, sequence)}/>'


def joint(generator, name, degrees):
    kind = "slide" if generator.random() < 0.3 else "hinge"
    high = 2.0 * (DEGREES if degrees and kind == "hinge" else 1.0)
    parts = [f'name="{name}"', f'axis="{words(unit(generator))}"', f'range="-1 {high!r}"']
    if kind == "slide":
        parts.append('class="slider"' if generator.random() < 0.5 else 'type="slide"')
    elif generator.random() < 0.5:
        parts.append(f'pos="{words(generator.uniform(-0.2, 0.2, 3))}"')
    return f"<joint {' '.join(parts)}/>"


def mjcf(seed):
    """A chain of bodies, some with two joints, some with none, some with a fixed body beside."""
    generator = np.random.default_rng(seed)
    degrees = bool(generator.integers(2))
    sequence = str(generator.choice(["xyz", "zyx", "XYZ", "ZYX", "zxz", "xYz", "ZxY"]))
    bodies, count = "", 0
    for number in range(int(generator.integers(1, 5)), 0, -1):
        joints = ""
        for _each in range(int(generator.integers(0, 3)) if number > 1 else 1):
            count += 1
            joints += joint(generator, f"j{number}{count}", degrees)
        beside = ""
        if generator.random() < 0.3:
            beside = (
                f'<body name="s{number}" pos="0.1 0 0.2" {orientation(generator, degrees, sequence)}>'
                f"{inertial(generator, degrees, sequence)}</body>"
            )
        bodies = (
            f'<body name="b{number}" pos="{words(generator.uniform(-0.5, 0.5, 3))}" '
            f"{orientation(generator, degrees, sequence)}>"
            f"{joints}{inertial(generator, degrees, sequence)}{beside}{bodies}</body>"
        )
    return (
        f'<mujoco model="random"><compiler angle="{"degree" if degrees else "radian"}" eulerseq="{sequence}"/>'
        '<default><default class="slider"><joint type="slide"/></default></default>'
        f"<worldbody>{bodies}</worldbody></mujoco>"
    )


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_torques_are_mujocos(tmp_path_factory, seed):
    path = tmp_path_factory.mktemp("mjcf") / "robot.xml"
    path.write_text(mjcf(seed))
    read = read_urdf(path)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    generator = np.random.default_rng(seed)
    motion = generator.normal(size=(3, 4, model.nv))
    regressor = standard_regressor(Geometry.from_robot(read.robot), *motion)
    torques = regressor @ read.standard
    names = [model.joint(k).name for k in range(model.njnt)]
    assert [each.name for each in read.robot.joints] == names
    for sample in range(motion.shape[1]):
        data.qpos[:], data.qvel[:], data.qacc[:] = motion[:, sample]
        mujoco.mj_inverse(model, data)
        scale = np.abs(data.qfrc_inverse).max()
        passive = data.qfrc_constraint  # a joint beyond its range is pushed back
        np.testing.assert_allclose(torques[sample], data.qfrc_inverse + passive, atol=1e-8 * max(scale, 1))
    low, high = model.jnt_range[0]
    limits = read.robot.joints[0].limits
    assert limits is not None
    assert limits.position == pytest.approx((low, high))


WRONG = {
    '<mujoco><include file="a.xml"/></mujoco>': "holds <include>; expand it first",
    "<mujoco/>": "has no <worldbody>",
    '<mujoco><compiler eulerseq="abc"/><worldbody/></mujoco>': 'eulerseq="abc">: must be three letters',
    '<mujoco><worldbody><body name="b"><joint type="ball"/></body></worldbody></mujoco>': "type 'ball'",
    '<mujoco><worldbody><body name="b" quat="0 0 0 0"><joint/></body></worldbody></mujoco>': "quat has no length",
    '<mujoco><worldbody><body name="b" pos="1 2"><joint/></body></worldbody></mujoco>': "pos '1 2' must be 3 numbers",
    '<mujoco><worldbody><body name="b"><joint class="x"/></body></worldbody></mujoco>': "no default class 'x'",
    '<mujoco><worldbody><body name="b"><joint name="j" ref="1"/></body></worldbody></mujoco>': "joint 'j': ref",
}


@pytest.mark.parametrize("text", WRONG)
def test_what_cannot_be_read_is_refused_in_one_line_that_names_it(tmp_path, text):
    path = tmp_path / "robot.xml"
    path.write_text(text)
    with pytest.raises(InputError) as refused:
        read_urdf(path)
    assert WRONG[text] in str(refused.value)
    assert "\n" not in str(refused.value)


def test_damaged_files_never_end_in_a_traceback(tmp_path):
    choose = random.Random(14)
    path = tmp_path / "robot.xml"
    for number in range(150):
        text = mjcf(number % 20)
        for _change in range(choose.choice([1, 3])):
            place = choose.randrange(len(text))
            cut = text[place : place + choose.randrange(20)] if choose.random() < 0.5 else ""
            text = (
                text[:place]
                + choose.choice(["nan", "-1", '"', "<", "", "1 2", "é"])
                + text[place + len(cut) :]
            )
        path.write_text(text, encoding="utf-8")
        try:
            read_urdf(path)
        except InputError as refusal:
            said = str(refusal)
        else:
            continue
        assert said.startswith(str(path))
        assert "\n" not in said


def test_shapes_without_an_inertial_and_a_free_base_are_said(tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text(
        '<mujoco><worldbody><body name="base"><freejoint/><geom type="mesh" mesh="m"/><body name="arm"><joint name="j"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></body></worldbody></mujoco>'
    )
    read = read_urdf(path)
    assert [joint.name for joint in read.robot.joints] == ["j"]
    assert any("'base' is free: taken as fixed" in words for words in read.remarks)
    assert any("'base, geom 1' is a mesh" in words for words in read.remarks)
