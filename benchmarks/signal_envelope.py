"""Time from a request to the bytes of a zoom on a million samples, and of the envelope alone.

    python benchmarks/signal_envelope.py

The peer is what a plot would need without an envelope: every visible sample as float32, and the envelope as
a loop over blocks in plain Python.
"""

import statistics
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from api.application import create_application
from api.service.envelope import envelope
from api.service.model_story import Fit, ModelStory
from api.service.prediction_files import write_prediction
from api.service.settings import ServiceSettings

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from fastapi.testclient import TestClient

SAMPLES = 1_000_000
POINTS = 2000
REPEATS = 21
EXPERIMENT = """format: 1
name: million
robot:
  gravity: [0.0, -9.81, 0.0]
  joints: [{name: j1, type: revolute, drive_gain: 10.0}]
payloads: [{name: none, mass: 0.0}]
sessions: [{file: session-00.csv, payload: none}]
"""


def median_milliseconds(work: Callable[[], object]) -> float:
    """Median of some runs, ms."""
    took = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        work()
        took.append(1e3 * (time.perf_counter() - begin))
    return statistics.median(took)


def loop_over_blocks(time_axis: np.ndarray, signals: dict[str, np.ndarray], points: int) -> list[list[float]]:
    """The same envelope, one block after the other."""
    length = -(-len(time_axis) // (points // 2))
    rows: list[list[float]] = [[] for _ in range(1 + len(signals))]
    for start in range(0, len(time_axis), length):
        rows[0] += [time_axis[start], time_axis[min(start + length // 2, len(time_axis) - 1)]]
        for row, values in zip(rows[1:], signals.values(), strict=True):
            block = values[start : start + length].tolist()
            row += [min(block), max(block)]
    return rows


def main() -> None:
    """Measure and print."""
    time_axis = 0.001 * np.arange(SAMPLES)
    random = np.random.default_rng(0)
    columns = {name: random.normal(size=SAMPLES) for name in ("measured", "predicted", "error")}
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder)
        experiment = data / "experiments" / "million"
        experiment.mkdir(parents=True)
        (experiment / "experiment.yaml").write_text(EXPERIMENT)
        (experiment / "session-00.csv").write_text("t,q1,v1\n0,0,0\n")
        story = ModelStory(experiment)
        fit_folder = story.new_fit_folder("m1", "f1")
        fit_folder.mkdir(parents=True)
        names = ("position", "velocity", "acceleration", "load")
        others = dict.fromkeys(names, columns["error"]) | {"moving": np.ones(SAMPLES), "temperature": None}
        prediction = SimpleNamespace(
            time=time_axis, measured=columns["measured"], predicted=columns["predicted"], **others
        )
        write_prediction(fit_folder, 0, 0, prediction)
        fit = Fit(
            id="f1", data="", sessions=1, created="", relative_error=None, relative_error_validation=None
        )
        story.add_version(model="usual", add=[], cause="fit", change=None, user="benchmark", fit=fit)
        application = create_application(ServiceSettings(data_folder=data))
        with TestClient(application, base_url="http://localhost:8000") as client:

            def zoom(**query: float) -> None:
                answer = client.get(
                    "/experiments/million/models/m1/signals",
                    params={"session": "session-00", "points": POINTS, **query},
                )
                assert answer.status_code == 200, answer.text

            rows = [
                ("zoom, whole million, 6 signals, by REST", median_milliseconds(zoom)),
                ("zoom, a tenth", median_milliseconds(lambda: zoom(**{"from": 400.0, "to": 500.0}))),
                ("zoom, a thousandth", median_milliseconds(lambda: zoom(**{"from": 400.0, "to": 401.0}))),
            ]
    ours = median_milliseconds(lambda: envelope(time_axis, columns, POINTS))
    loop = median_milliseconds(lambda: loop_over_blocks(time_axis, columns, POINTS))
    every = median_milliseconds(lambda: np.array([time_axis, *columns.values()], "<f4").tobytes())
    print(f"{SAMPLES} samples, {POINTS} rows, median of {REPEATS}")
    print(f"{'':44} {'ms':>9} {'kB':>8}")
    for name, took in rows:
        print(f"{name:44} {took:9.2f} {28 * POINTS / 1e3:8.0f}")
    print(f"{'envelope alone, 3 signals':44} {ours:9.2f} {16 * POINTS / 1e3:8.0f}")
    print(
        f"{'peer: the same as a loop in Python':44} {loop:9.2f} {16 * POINTS / 1e3:8.0f}   {loop / ours:.0f} x"
    )
    print(
        f"{'peer: every sample as float32':44} {every:9.2f} {16 * SAMPLES / 1e3:8.0f}   {every / ours:.1f} x"
    )


if __name__ == "__main__":
    main()
