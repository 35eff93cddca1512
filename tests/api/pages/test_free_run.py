"""The figure of a free run: position and speed with the errors beneath, and where the runs left the record."""

import re

import numpy as np
import pytest

from api.pages.figures.free_run import FreeRun, draw_free_run
from api.service.free_run_curves import MotionCurves
from tests.api.pages.path_points import points_of

TIME = np.linspace(0.0, 10.0, 500)


def curves(usual: bool) -> MotionCurves:
    measured, model = np.sin(TIME), 1.1 * np.sin(TIME)
    beside = 1.2 * np.sin(TIME) if usual else np.full(len(TIME), np.nan)
    return MotionCurves(measured, model, beside, model - measured, beside - measured)


def drawn(usual: bool = True, left: float | None = None, left_usual: float | None = None) -> str:
    run = FreeRun(TIME, curves(usual), curves(usual), "rad", "mrad", left, left_usual)
    return draw_free_run("j2", run)


def test_errors_are_drawn_to_one_scale_in_the_small_unit() -> None:
    drawing = drawn()
    assert [
        label
        for label in ("position, rad", "error, mrad", "speed, rad/s", "error, mrad/s")
        if label in drawing
    ]
    heights = {
        kind: np.ptp(points_of(data)[:, 1])
        for data, kind in re.findall(r'<path d="([^"]+)" class="curve thin ?(before|)"', drawing)
    }
    assert heights["before"] / heights[""] == pytest.approx(2.0, rel=0.01)
    assert ">200</text>" in drawing  # mrad
    assert ">−200</text>" in drawing
    assert 'class="curve thin before"' not in drawn(usual=False)


@pytest.mark.parametrize(
    ("largest", "tick"), [(5.2e-3, "5"), (9.9e-3, "10"), (1.3e-3, "1"), (2.2e-5, "0.02")]
)
def test_an_error_has_a_scale_whatever_its_size(largest, tick) -> None:
    measured = np.zeros(len(TIME))
    model = largest * np.sin(TIME)
    run = MotionCurves(measured, model, np.full(len(TIME), np.nan), model, np.full(len(TIME), np.nan))
    drawing = draw_free_run("j2", FreeRun(TIME, run, run, "rad", "mrad"))
    assert drawing.count(f">{tick}</text>") >= 2
    assert f">−{tick}</text>" in drawing


def test_a_mark_stands_where_a_run_leaves_the_record() -> None:
    assert "leaves" not in drawn()
    drawing = drawn(left=2.0, left_usual=8.0)
    assert "the model leaves the record" in drawing
    assert "the usual model leaves it" in drawing
    at = [float(x) for x in re.findall(r'<line x1="([0-9.]+)"[^>]+class="(?:limit|curve before)"', drawing)]
    assert at == pytest.approx([58.0 + 0.2 * 792.0, 58.0 + 0.8 * 792.0], abs=0.2)
