"""What a plan's picture shows: its setpoints, the current of each payload, the limits, and what repeats."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.plan_picture import PIXELS_WORTH, draw_plan
from daq.excitation.sinusoid import Sinusoids
from daq.excitation.trapezoid import Dwell, Move
from daq.rig import Rig
from identify.recording.errors import InputError
from tests.daq.excitation.planned_pendulum import request_of


@pytest.fixture(scope="module")
def rig():
    return Rig.load("rx130l-joint3-simulated")


@pytest.fixture(scope="module")
def plan(rig):
    """A swing of 0.2 Hz that repeats twice between its fades, and a move."""
    swing = Sinusoids(
        frequency=0.2, repeats=2, fade=1.5, centre=(0.35,), cosine=((0.1, 0.02),), sine=((0.2, -0.05),)
    )
    move = Move(to=(0.6,), duration=1.5, ramp=0.4)
    return ExcitationPlan(joints=("j3",), start=(0.35,), phases=(Dwell(duration=1.0), swing, move))


@pytest.fixture(scope="module")
def figure(rig, plan, tmp_path_factory):
    """The figure as it is saved."""
    saved = []
    file = tmp_path_factory.mktemp("picture") / "plan.svg"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", lambda figure, path, dpi: saved.append((figure, path)))
        draw_plan(plan, request_of(rig), file)
    ((figure, path),) = saved
    assert path == file
    return figure


def curves(panel):
    """(x, y) of the solid lines."""
    return [line.get_data() for line in panel.get_lines() if line.get_linestyle() == "-"]


def limits(panel):
    return sorted(line.get_ydata()[0] for line in panel.get_lines() if line.get_linestyle() == "--")


def test_position_and_speed_are_the_plan_s_setpoints_between_the_rig_s_limits(figure, plan, rig):
    position, speed, current = figure.axes
    ((time, drawn),) = curves(position)
    assert len(time) == PIXELS_WORTH
    assert (time[0], time[-1]) == (0.0, plan.duration)
    setpoints = plan.setpoints(np.asarray(time))
    np.testing.assert_allclose(drawn, setpoints.position[:, 0], rtol=1e-12)
    ((_, drawn),) = curves(speed)
    np.testing.assert_allclose(drawn, setpoints.velocity[:, 0], rtol=1e-12)
    assert limits(position) == list(rig.axes[0].limits.position) == [-1.2, 1.9]
    assert limits(speed) == [-1.2, 1.2]
    assert limits(current) == [-18.0, 18.0]
    assert [panel.get_ylabel() for panel in figure.axes] == [
        "position, rad",
        "speed, rad/s",
        "predicted current, A",
    ]


def test_the_current_is_the_model_s_torque_over_the_drive_gain_for_each_payload(figure, plan, rig):
    """J q̈ + MX g cos q + FV q̇ + FC sign q̇ and a point mass at 1.277 m, over N K_t = 95 · 0.37 N m/A."""
    drawn = curves(figure.axes[2])
    assert len(drawn) == len(rig.payloads) == 3
    for (time, current), payload in zip(drawn, rig.payloads, strict=True):
        q, dq, ddq = (values[:, 0] for values in plan.setpoints(np.asarray(time)))
        torque = 31.0 * ddq + 21.0 * 9.81 * np.cos(q) + 48.0 * dq + 20.0 * np.sign(dq)
        torque += payload.mass * 1.277 * (1.277 * ddq + 9.81 * np.cos(q))
        np.testing.assert_allclose(current, torque / (95.0 * 0.37), rtol=1e-9, atol=1e-12)
    legend = [text.get_text() for text in figure.axes[2].get_legend().get_texts()]
    assert legend == ["none", "disk-3.5", "disk-7"]


def test_what_repeats_exactly_is_shaded_in_every_panel(figure, plan):
    assert [(begin, end) for begin, end, _ in plan.repeated] == [(2.5, 12.5)]  # 1 + 1.5 s, then 2 / 0.2 Hz
    for panel in figure.axes:
        shaded = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in panel.patches]
        np.testing.assert_allclose(shaded, [(begin, end) for begin, end, _ in plan.repeated], rtol=1e-9)


def test_a_picture_that_cannot_be_drawn_or_written_is_refused(plan, rig, tmp_path):
    with pytest.raises(InputError, match=r"plan\.docx: a picture ends in one of .*png.*svg"):
        draw_plan(plan, request_of(rig), tmp_path / "plan.docx")
    with pytest.raises(InputError, match=r"plan\.PNG: cannot be written \(No such file"):
        draw_plan(plan, request_of(rig), tmp_path / "none" / "plan.PNG")
