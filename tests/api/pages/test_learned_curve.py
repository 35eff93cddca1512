"""The picture of a learned torque: support points where the document says, with bars of two deviations."""

import re

import numpy as np

from api.pages.figures.learned_curve import LearnedCurve, draw_learned_curve


def test_every_support_point_is_drawn_and_those_with_a_deviation_have_a_bar() -> None:
    knots = np.array([-1.0, 0.0, 1.0])
    forwards = LearnedCurve(knots, np.array([0.0, 2.0, -1.0]), np.array([0.0, 0.1, np.nan]), "")
    backwards = LearnedCurve(knots, -forwards.value, forwards.deviation, "predicted")
    drawn = draw_learned_curve([backwards, forwards], None, "position", "rad", "N m")
    assert len(re.findall("<circle ", drawn)) == 6
    bars = re.findall(r'<line x1="([\d.]+)" y1="([\d.]+)" x2="\1" y2="([\d.]+)" class="deviation"', drawn)
    assert len(bars) == 2
    heights = [float(y1) - float(y2) for _, y1, y2 in bars]
    zero, two = (float(re.findall(rf'cx="{x}" cy="([\d.]+)"', drawn)[-1]) for x in ("60", "316"))
    assert np.allclose(heights, 0.4 * (zero - two) / 2.0, atol=0.3)
    assert "position, rad" in drawn
