"""The picture of a proof: following errors in thousandths, the plan beside them."""

import numpy as np
import pytest
from matplotlib.backends.backend_svg import FigureCanvasSVG

from api.compensation_picture import draw
from api.proof import FollowingErrors
from daq.rig import Rig


@pytest.fixture(scope="module")
def errors():
    """Of six joints, each ten times that of the joint before it, and half with torque."""
    time = np.linspace(0.0, 3.0, 50)
    before = 1e-6 * 10.0 ** np.arange(6) * np.sin(time)[:, None]
    return FollowingErrors(time, np.cos(time)[:, None] * np.arange(1, 7), before, 0.5 * before)


@pytest.fixture(scope="module")
def rig():
    """TX40, its third joint made a slide."""
    tx40 = Rig.load("tx40-simulated")
    joints = list(tx40.robot.joints)
    joints[2] = joints[2].model_copy(update={"type": "prismatic"})
    return tx40.model_copy(update={"robot": tx40.robot.model_copy(update={"joints": tuple(joints)})})


@pytest.fixture(scope="module")
def panels(rig, errors):
    """The six panels and the scales at their right, joint by joint."""
    drawn = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(FigureCanvasSVG, "print_svg", lambda canvas, file: drawn.append(canvas.figure))
        assert draw(rig, errors) == b""
    (figure,) = drawn
    return figure.axes[:6], figure.axes[6:]


def test_each_joint_has_its_errors_without_and_with_torque_in_thousandths(rig, errors, panels):
    for joint, panel in enumerate(panels[0]):
        without, with_torque = panel.get_lines()
        np.testing.assert_allclose(without.get_xdata(), errors.time)
        np.testing.assert_allclose(without.get_ydata(), 1000.0 * errors.before[:, joint], rtol=1e-12)
        np.testing.assert_allclose(with_torque.get_ydata(), 1000.0 * errors.after[:, joint], rtol=1e-12)
        unit = "mm" if joint == 2 else "mrad"
        assert panel.get_ylabel() == f"{rig.axes[joint].joint}, {unit}"
    labels = [text.get_text() for text in panels[0][0].get_legend().get_texts()]
    assert labels == ["without feedforward torque", "with it"]


def test_the_plan_stands_at_the_right_in_its_own_unit_behind_the_errors(errors, panels):
    for joint, (panel, planned) in enumerate(zip(*panels, strict=True)):
        (line,) = planned.get_lines()
        np.testing.assert_allclose(line.get_ydata(), errors.position[:, joint])
        assert planned.get_ylabel() == f"planned, {'m' if joint == 2 else 'rad'}"
        assert panel.get_zorder() > planned.get_zorder()
        assert not panel.patch.get_visible()


def test_it_is_an_svg(errors):
    first = [each[:, :1] for each in (errors.position, errors.before, errors.after)]
    assert b"<svg" in draw(Rig.load("rx130l-joint3-simulated"), FollowingErrors(errors.time, *first))
