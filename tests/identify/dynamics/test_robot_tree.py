"""Links and joints as elements of a URDF, read back by Pinocchio."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from identify.dynamics.robot_tree import RobotTree, numbers, placed
from identify.recording.errors import InputError

FILE = Path("robot.sdf")


def test_a_joint_and_a_body_stand_where_pinocchio_finds_them():
    random = np.random.default_rng(5)
    at_joint, at_body = (
        placed(random.uniform(-1, 1, 3), Rotation.random(random_state=seed).as_matrix()) for seed in (1, 2)
    )
    tensor = np.array([[0.5, 0.02, -0.03], [0.02, 0.6, 0.04], [-0.03, 0.04, 0.7]])
    tree = RobotTree("arm")
    tree.link("base")
    tree.link("link", mass=3.0, placement=at_body, tensor=tensor)
    tree.joint("j", "revolute", "base", "link", at_joint, axis=(0, 0, 1), limits=(-1.0, 2.0), speed=3.0)
    tree.root.find("joint/limit").set("effort", "1")  # which Pinocchio wants, and a file may not state
    model = pin.buildModelFromXML(ElementTree.tostring(tree.root, encoding="unicode"))
    np.testing.assert_allclose(model.jointPlacements[1].homogeneous, at_joint, atol=1e-12)
    body = model.inertias[1]
    assert body.mass == pytest.approx(3.0)
    np.testing.assert_allclose(body.lever, at_body[:3, 3], atol=1e-12)
    np.testing.assert_allclose(body.inertia, at_body[:3, :3] @ tensor @ at_body[:3, :3].T, atol=1e-12)
    assert (model.lowerPositionLimit[0], model.upperPositionLimit[0]) == (-1.0, 2.0)
    assert model.velocityLimit[0] == 3.0


def test_what_is_not_stated_is_left_out():
    tree = RobotTree("arm")
    tree.link("empty")
    tree.joint("free", "continuous", "base", "empty", np.eye(4))
    tree.joint("led", "revolute", "base", "empty", np.eye(4), mimics="free")
    link, free, led = tree.root
    assert list(link) == []
    assert free.find("limit") is None
    assert free.find("mimic") is None
    assert led.find("mimic").attrib == {"joint": "free"}


def test_numbers_are_as_many_as_asked_for_and_finite():
    np.testing.assert_array_equal(numbers(FILE, "link", "pose", " 1 -2e3\n.5 ", 3), [1.0, -2000.0, 0.5])
    for text in ("1 2", "1 2 3 4", "1 2 x", "1 2 nan", "1 2 inf", ""):
        with pytest.raises(InputError, match=r"robot.sdf: 'link': pose '.*' must be 3 numbers"):
            numbers(FILE, "link", "pose", text, 3)
    with pytest.raises(InputError, match="must be a number"):
        numbers(FILE, "link", "mass", "heavy", 1)
