"""The panel of the free run: every session with its errors, and the one that is drawn."""

from types import SimpleNamespace

import numpy as np

from api.pages.choices import ALL_SESSIONS
from api.pages.free_run_view import free_run_context
from api.pages.motion_table import motion_panel
from api.service.free_run_curves import FreeRunCurves, MotionCurves
from identify.recording import InputError
from identify.results.simulation import (
    HorizonErrors,
    JointMotionError,
    SessionMotionError,
    SimulationDocument,
)


def errors(position: float, left: float | None = None) -> JointMotionError:
    return JointMotionError(
        joint="j1",
        position_rms=position,
        velocity_rms=2.0 * position,
        unit="rad",
        windows=1,
        left_record_at=left,
        position_rms_usual=2.0 * position,
        velocity_rms_usual=None,
    )


def horizon(seconds: float | None, role: str, files: dict[str, JointMotionError]) -> HorizonErrors:
    sessions = tuple(
        SessionMotionError(file=file, payload="none", joints=(each,)) for file, each in files.items()
    )
    return HorizonErrors(
        horizon=seconds, role=role, joints=(), sessions=sessions, energy_drift=None, simulated_seconds=1.0
    )


DOCUMENT = SimulationDocument(
    experiment="e",
    model="usual",
    effects=(),
    controller=None,
    horizons=(
        horizon(1.0, "identification", {"a.csv": errors(9.0)}),
        horizon(None, "identification", {"a.csv": errors(0.001), "b.csv": errors(0.002, left=3.25)}),
        horizon(None, "validation", {"c.csv": errors(2e-6)}),
    ),
    along_record=(),
    remarks=(),
)
STORED = SimpleNamespace(id="e", joint_names=["j1"], fitted_files=lambda _shown: ["b.csv", "a.csv", "c.csv"])
SHOWN = SimpleNamespace(version=SimpleNamespace(id="m3"))


def panel(session: str, document: SimulationDocument | None = DOCUMENT, kept: bool = True) -> dict | None:
    time = np.linspace(0.0, 1.0, 20)
    curves = FreeRunCurves(time, MotionCurves(*[time] * 5), MotionCurves(*[time] * 5))
    use = SimpleNamespace(
        simulation=lambda _experiment, _model: document,
        free_run=lambda _experiment, _model, _file, _joint: curves if kept else None,
    )
    return free_run_context(use, STORED, SHOWN, "j1", session)["free_run"]


def test_the_session_of_the_page_is_drawn_and_of_all_the_one_with_the_largest_error() -> None:
    assert panel("a.csv")["session"] == "2 · none"
    shown = panel(ALL_SESSIONS)
    assert (shown["session"], shown["chosen"]) == ("1 · none", False)
    assert "leaves the record" in shown["figures"].wide
    assert "leaves the record" not in panel("a.csv")["figures"].wide


def test_every_session_stands_with_its_errors_in_the_order_of_the_tabs() -> None:
    rows = panel("c.csv")["rows"]
    assert [row.words for row in rows] == ["1 · none", "2 · none", "3 · none, validation"]
    assert [row.here for row in rows] == [False, False, True]
    assert (rows[0].error, rows[0].usual, rows[0].usual_speed) == ("2 mrad", "4 mrad", "–")
    assert [row.left for row in rows] == ["at 3.25 s", "never", "never"]
    assert rows[2].error == "2 µrad"
    assert "session=b.csv&version=m3#free-run" in rows[0].link


def test_a_damaged_file_hides_no_page() -> None:
    def damaged(*_asked: object) -> None:
        raise InputError("simulation.json: not JSON")

    use = SimpleNamespace(
        simulation=damaged,
        free_run=damaged,
        simulation_fault=lambda *_asked: None,
        simulating=lambda *_asked: None,
    )
    assert free_run_context(use, STORED, SHOWN, "j1", ALL_SESSIONS)["free_run"] is None
    assert "cannot be read" in motion_panel(use, "e", "m3", "j1")["motion_problem"]
    use.simulation = lambda _experiment, _model: DOCUMENT
    assert free_run_context(use, STORED, SHOWN, "j1", ALL_SESSIONS)["free_run"]["figures"] is None


def test_without_a_simulation_there_is_no_panel_and_without_curves_no_picture() -> None:
    assert panel("a.csv", document=None) is None
    assert panel("a.csv", kept=False)["figures"] is None
