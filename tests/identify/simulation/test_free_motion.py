"""Free runs beside the measured motion: row by row, with nothing where a run had ended."""

from types import SimpleNamespace

import numpy as np

from identify.simulation.free_motion import free_motions


def run(rows, lasts, offset):
    """A measured stretch that begins at 5 s, and a course `offset` off it over its first `lasts` rows."""
    q = np.linspace(0.0, 1.0, rows)[:, None] * np.array([1.0, -2.0])
    motion = SimpleNamespace(time=5.0 + 0.01 * np.arange(rows), q=q, dq=2.0 * q)
    sized = type("Motion", (), {"__len__": lambda _self: rows, **vars(motion)})()
    course = SimpleNamespace(q=q[:lasts, None] + offset, dq=2.0 * q[:lasts, None])
    return sized, course


def test_every_stretch_keeps_its_rows_and_the_time_of_its_session():
    kept = free_motions(
        "a.csv", 4.0, [run(50, 50, 0.1), run(20, 12, 0.2)], [run(50, 30, 0.3), run(20, 20, 0.0)]
    )
    assert [len(each.time) for each in kept] == [50, 20]
    assert kept[0].time[0] == 1.0
    np.testing.assert_allclose(kept[0].model_q - kept[0].q, 0.1)
    np.testing.assert_array_equal(np.isnan(kept[1].model_q[:, 0]), np.arange(20) >= 12)
    np.testing.assert_array_equal(np.isnan(kept[0].usual_dq[:, 1]), np.arange(50) >= 30)


def test_the_usual_model_has_no_other_beside_it():
    (kept,) = free_motions("a.csv", 0.0, [run(10, 10, 0.0)], None)
    assert kept.usual_q is kept.usual_dq is None
