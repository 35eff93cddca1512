"""Sessions end to end: where each begins, what a window holds, and that no line joins them."""

import numpy as np
import pytest

from api.pages.torque_curves import BETWEEN_SESSIONS, TorqueCurves
from api.service.torque_outline import outline
from tests.api.made_samples import made_samples


def curves(*beginnings: float) -> TorqueCurves:
    """Sessions of 10 s at 1 kHz whose own times begin there; the torque is the time in the plot's order."""
    parts = {}
    for number, begin in enumerate(beginnings):
        time = begin + 0.001 * np.arange(10_001)
        parts[f"{number}.csv"] = made_samples(
            time, measured=np.full(len(time), number + 1.0), moving=np.ones(len(time))
        )
    return TorqueCurves(parts, {file: outline(part) for file, part in parts.items()})


def test_one_session_keeps_its_own_time_and_several_follow_one_another() -> None:
    assert curves(5.0).beginnings == [(5.0, "0.csv", 5.0)]
    second = 10.0 + BETWEEN_SESSIONS
    assert curves(5.0, -3.0).beginnings == [(0.0, "0.csv", 5.0), (pytest.approx(second), "1.csv", -3.0)]


@pytest.mark.parametrize("points", [300, 50_000])
def test_a_pause_is_empty_and_each_session_stands_in_its_place(points: int) -> None:
    window = curves(5.0, -3.0).window(None, None, points)
    assert np.all(np.diff(window.time) > 0)
    assert len(window.time) <= points
    measured = window.curves["measured"]
    pause = (window.time > 10.01) & (window.time < 9.99 + BETWEEN_SESSIONS)
    assert pause.any()
    assert np.isnan(measured[pause]).all()
    assert set(measured[window.time <= 10.0]) == {1.0}
    assert set(measured[window.time >= 10.0 + BETWEEN_SESSIONS]) == {2.0}
    assert window.sums.samples == 20_002
    assert window.sums.error == pytest.approx(10_001 * (1 + 4))


def test_a_window_in_one_session_holds_no_other_and_marks_its_chosen_samples() -> None:
    window = curves(5.0, -3.0).window(13.0, 14.0, 50_000)
    assert list(window.pieces) == ["1.csv"]
    chosen = np.zeros(10_001, bool)
    chosen[1500] = True  # 1.5 s after the session's beginning
    marks = window.marked(lambda file: chosen)
    assert window.time[marks == 1] == pytest.approx([10.0 + BETWEEN_SESSIONS + 1.5])
