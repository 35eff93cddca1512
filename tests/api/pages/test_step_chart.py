"""The staircase of errors, model by model."""

import xml.etree.ElementTree as ElementTree

import numpy as np

from api.pages.figures.step_chart import ModelStep, draw_step_chart


def test_the_staircase_descends_by_the_errors_and_draws_the_floor() -> None:
    steps = [
        ModelStep("usual", 0.08),
        ModelStep("+ a", 0.04, current=True),
        ModelStep("+ b", 0.02, undone=True),
    ]
    drawing = draw_step_chart(steps, 0.01)
    root = ElementTree.fromstring(drawing)
    circles = [element for element in root.iter() if element.tag.endswith("circle")]
    heights = [float(circle.get("cy", "nan")) for circle in circles]
    zero = 190.0 - 34.0
    # heights above the axis are in proportion to the errors
    np.testing.assert_allclose((zero - heights[0]) / (zero - heights[1]), 2.0, rtol=0.01)
    np.testing.assert_allclose((zero - heights[0]) / (zero - heights[2]), 4.0, rtol=0.02)
    assert "noise floor 1.00" in drawing
