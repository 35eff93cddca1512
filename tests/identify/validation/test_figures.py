"""What the figures of a validation show: the curves that are drawn, their units, and errors worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from identify.estimation.prediction import Prediction
from identify.validation.figures import BINS, LARGEST_DRAWN, draw_course, draw_where, error_over, save


def prediction(velocity, residual, moving=None, joint="elbow"):
    """A joint at the given speeds whose model errs by the given torques; its position runs from 0 to 1."""
    velocity, residual = np.asarray(velocity, float), np.asarray(residual, float)
    count = len(velocity)
    measured = np.full(count, 2.0)
    return Prediction(
        file="session-00.csv",
        joint=joint,
        time=np.arange(count) / 100,
        position=np.linspace(0, 1, count),
        velocity=velocity,
        acceleration=np.zeros(count),
        load=3 * velocity,
        measured=measured,
        predicted=measured - residual,
        moving=np.ones(count, bool) if moving is None else np.asarray(moving),
        temperature=None,
    )


def test_the_error_over_a_variable_is_the_root_mean_square_in_each_bin():
    # bins of width 1 from 0 to 24: four samples of ±3 and ±1 in the first, five of 2 in the last, three in between
    velocity = [0.0, 0.1, 0.5, 0.9, *[23.5] * 4, 24.0, *[11.5] * 3]
    residual = [3.0, -3.0, 1.0, -1.0, *[2.0] * 5, *[7.0] * 3]
    centre, error = error_over([prediction(velocity, residual)], "velocity")
    assert centre == pytest.approx(np.arange(BINS) + 0.5)
    assert error[0] == pytest.approx(np.sqrt(5.0))
    assert error[-1] == pytest.approx(2.0)
    assert np.isnan(error[1:-1]).all()  # three samples are too few, and so are none


def test_samples_at_rest_do_not_count_and_sessions_are_pooled():
    resting = prediction([0.0, *[24.0] * 4], [99.0, *[1.0] * 4], [False, *[True] * 4])
    other = prediction([0.0] * 4, [6.0] * 4)
    centre, error = error_over([resting, other], "velocity")
    assert (centre[0], centre[-1]) == pytest.approx((0.5, 23.5))
    assert (error[0], error[-1]) == pytest.approx((6.0, 1.0))


@pytest.mark.parametrize("moving", [[False] * 4, [True] * 4])
def test_nothing_is_drawn_over_a_variable_that_does_not_change(moving):
    centre, error = error_over([prediction([2.0] * 4, [1.0] * 4, moving)], "velocity")
    assert len(centre) == len(error) == 0


def test_a_course_shows_measured_predicted_and_their_difference_of_each_joint():
    parts = [prediction([1.0] * 5, [0.5] * 5), prediction([1.0] * 5, [-1.0] * 5, joint="slide")]
    figure = draw_course(parts, "Session 3", [True, False])
    for axis, part, label in zip(figure.axes, parts, ["elbow: torque, N m", "slide: force, N"], strict=True):
        curves = {line.get_label(): line.get_ydata() for line in axis.lines}
        assert list(curves) == ["measured", "predicted", "error"]
        assert curves["measured"] == pytest.approx(part.measured)
        assert curves["predicted"] == pytest.approx(part.predicted)
        assert curves["error"] == pytest.approx(part.measured - part.predicted)
        assert all(line.get_xdata() == pytest.approx(part.time) for line in axis.lines)
        assert axis.get_ylabel() == label
    assert [axis.get_title(loc="right") for axis in figure.axes] == [
        "relative error 25.00 %",
        "relative error 50.00 %",
    ]
    assert figure.axes[0].get_title(loc="left") == "Session 3"
    assert figure.axes[-1].get_xlabel() == "time, s"


def test_a_long_course_is_thinned_evenly_and_a_short_one_not():
    for count, drawn, step in ((LARGEST_DRAWN, LARGEST_DRAWN, 1), (3 * LARGEST_DRAWN, LARGEST_DRAWN, 3)):
        (axis,) = draw_course([prediction(np.ones(count), np.zeros(count))], "", [True]).axes
        assert [len(line.get_ydata()) for line in axis.lines] == [drawn] * 3
        assert axis.lines[0].get_xdata()[:2] == pytest.approx([0.0, step / 100])


def test_where_the_error_sits_has_a_row_for_each_joint_and_a_line_for_each_model():
    velocity = np.linspace(0, 24, 200)
    models = {
        "rigid": [
            [prediction(velocity, np.full(200, 4.0))],
            [prediction(velocity, np.full(200, 2.0), joint="slide")],
        ],
        "usual": [
            [prediction(velocity, np.full(200, 1.0))],
            [prediction(velocity, np.full(200, 0.5), joint="slide")],
        ],
    }
    figure = draw_where(models, [True, False])
    labels = [axis.get_xlabel() for axis in figure.axes]
    assert labels == [
        *("speed, rad/s", "position, rad", "load τ_out, N m"),
        *("speed, m/s", "position, m", "load τ_out, N"),
    ]
    assert figure.axes[0].get_ylabel() == "elbow: rms error, N m"
    assert figure.axes[3].get_ylabel() == "slide: rms error, N"
    for axis, heights in zip(figure.axes, [(4.0, 1.0)] * 3 + [(2.0, 0.5)] * 3, strict=True):
        assert [line.get_label() for line in axis.lines] == ["rigid", "usual"]
        for line, height in zip(axis.lines, heights, strict=True):
            assert line.get_ydata() == pytest.approx(np.full(BINS, height))
        assert axis.get_ylim()[0] == 0


def test_a_figure_is_written_in_both_formats_and_the_same_result_gives_the_same_file(tmp_path):
    figure = draw_course([prediction([1.0] * 5, [0.5] * 5)], "", [True])
    assert save(figure, tmp_path, "course") == ["course.png", "course.svg"]
    first = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert first["course.png"].startswith(b"\x89PNG")
    assert b"<svg" in first["course.svg"]
    assert b"<dc:date>" not in first["course.svg"]
    save(figure, tmp_path, "course")
    assert (tmp_path / "course.svg").read_bytes() == first["course.svg"]
