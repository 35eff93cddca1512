"""First paint of every page, and a zoom on a million samples: how long a person waits.

A service with one experiment of three sessions, one of them a million samples long, is asked by Chromium as a person's
browser asks it: cold (a service that has just been started, and a browser without a cache) and warm. Printed: the server's
answer, first contentful paint and everything loaded, in ms, against the limit of 500 ms, and the kB that travelled against
300 kB; then the server's time for a zoom against 150 ms. The figures of the fits were made when they were stored, as the
service does; with --nothing-kept they are those of an older version, and made for whoever comes first.

    python benchmarks/page_paint.py [--samples 1000000] [--repeats 5] [--nothing-kept]
"""

import argparse
import os
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import httpx
import numpy as np
import yaml

from api.pages.figures_ahead import make_figures
from api.pages.kept_numbers import FOLDER
from api.pages.stored_models import StoredExperiment
from api.service.model_story import Fit, ModelStory, data_fingerprint, now_text
from api.service.prediction_files import write_candidate, write_prediction
from identify.effects.catalogue import effects
from identify.recording.experiment_file import read_experiment_file
from identify.results.diagnosis import Candidate, DiagnosisDocument, JointDiagnosis
from identify.results.effect import EffectOnJoint
from identify.results.identification import IdentificationDocument, JointError, Parameter, SessionError

PAINT_LIMIT = 500.0  # ms
BETWEEN = 1.0  # s from the service's first answer to the first page
ZOOM_LIMIT = 150.0  # ms
SHORT_SESSION = 6000  # samples of the two other sessions
EXPERIMENT = "million"
CANDIDATES = ("load-friction", "stribeck", "viscous-power", "backlash", "presliding", "delay")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
]
PAGES = (
    "sign-in",
    "experiments",
    "rig",
    "new-session",
    "live",
    f"experiments/{EXPERIMENT}/model",
    f"experiments/{EXPERIMENT}/missing",
    f"experiments/{EXPERIMENT}/results",
    f"experiments/{EXPERIMENT}/report",
    "account",
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=1_000_000)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--nothing-kept", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder)
        write_experiment(data / "experiments" / EXPERIMENT, options.samples)
        if not options.nothing_kept:
            keep_figures(data)
        if CHROMIUM is None:
            print("No Chromium here (Debian package chromium): only the server is measured.")
        else:
            paint(data, options.repeats, options.nothing_kept)
        with service(data) as address:
            cold = first_look(address, data)
            zoom(address, options.samples, options.repeats, cold)


def write_experiment(folder: Path, samples: int) -> None:
    """Two models of three sessions, in the form in which the service keeps them."""
    lengths = {"session-00.csv": samples, "session-01.csv": SHORT_SESSION, "session-02.csv": SHORT_SESSION}
    payloads = {"session-00.csv": "none", "session-01.csv": "disk", "session-02.csv": "disk"}
    folder.mkdir(parents=True)
    declared = {
        "format": 1,
        "name": EXPERIMENT,
        "robot": {
            "gravity": [0.0, -9.81, 0.0],
            "joints": [{"name": "j1", "type": "revolute", "drive_gain": 35.15}],
        },
        "payloads": [
            {"name": "none", "mass": 0.0},
            {"name": "disk", "mass": 3.4584, "com": [1.277, 0.0, 0.0]},
        ],
        "sessions": [{"file": file, "payload": payloads[file]} for file in lengths],
    }
    (folder / "experiment.yaml").write_text(yaml.safe_dump(declared))
    for file in lengths:
        (folder / file).write_text("t,q1,v1\n0,0,0\n0.001,0,0\n")
    story = ModelStory(folder)
    for number, (noise, add) in enumerate(((8.0, []), (3.0, ["stribeck@j1"])), start=1):
        fit = story.new_fit_folder(f"m{number}", "f1")
        fit.mkdir(parents=True)
        for index, length in enumerate(lengths.values()):
            of_session = motion(length, noise)
            write_prediction(fit, index, 0, of_session)
            for rank in range(1, 1 + len(CANDIDATES)):
                closer = of_session.predicted + 0.3 * (of_session.measured - of_session.predicted)
                write_candidate(fit, index, 0, rank, closer)
        (fit / "identification.json").write_text(
            document(noise / 100, payloads, sum(lengths.values())).json_text()
        )
        stored = Fit(
            id="f1",
            data=data_fingerprint(folder),
            sessions=3,
            created=now_text(),
            relative_error=noise / 100,
            relative_error_validation=None,
        )
        story.add_version(
            model="usual",
            add=add,
            cause="effect added" if add else "fit",
            change=add[-1] if add else None,
            user="benchmark",
            fit=stored,
        )
        story.store_diagnosis(f"m{number}", diagnosis(noise / 100))


def motion(samples: int, noise: float) -> SimpleNamespace:
    """A sum of sinusoids at 1 kHz and its torque with white noise."""
    t = np.arange(samples) * 1e-3
    q = 0.8 * np.sin(0.7 * t) + 0.3 * np.sin(2.3 * t)
    dq, ddq = np.gradient(q, t), np.gradient(np.gradient(q, t), t)
    load = 30 * ddq + 150 * np.sin(q)
    predicted = load + 20 * np.sign(dq) + 40 * dq
    error = noise * np.random.default_rng(1).normal(size=samples)
    return SimpleNamespace(
        time=t,
        position=q,
        velocity=dq,
        acceleration=ddq,
        load=load,
        measured=predicted + error,
        predicted=predicted,
        moving=np.ones(samples, bool),
        temperature=None,
    )


def document(error: float, payloads: dict[str, str], samples: int) -> IdentificationDocument:
    """What a fit found, of the usual size."""
    return IdentificationDocument(
        experiment=EXPERIMENT,
        model="usual",
        effects=tuple(EffectOnJoint(effect=name, joint="j1") for name in ("viscous", "coulomb", "offset")),
        relative_error=error,
        relative_error_validation=None,
        joints=(
            JointError(joint="j1", relative_error=error, relative_error_validation=None, noise_floor=0.01),
        ),
        sessions=tuple(
            SessionError(file=file, payload=payload, role="identification", relative_error=error)
            for file, payload in payloads.items()
        ),
        parameters=tuple(
            Parameter(
                name=name,
                joint="j1",
                value=30.9,
                std=0.14,
                std_robust=0.4,
                relative_std_percent=0.46,
                unit="kg m^2",
                grouping=None,
            )
            for name in ("ZZ1R", "MX1", "MY1", "FV1", "FC1")
        ),
        condition_number=31.2,
        samples=samples,
        form="linear",
        estimator="ordinary",
        eliminated=(),
        constants=(),
        relative_error_left_out=None,
        payloads=(),
        speeds=(),
        signals=(),
        not_identifiable=(),
        remarks=(),
    )


def diagnosis(error: float) -> DiagnosisDocument:
    """What a diagnosis found, of the usual size."""
    candidates = tuple(
        Candidate(
            effect=name,
            rank=rank,
            relative_error_before=error,
            relative_error_after=error * (0.4 + 0.1 * rank),
            heldout_error_before=error,
            heldout_error_after=error * (0.4 + 0.1 * rank),
            p_value=10.0 ** (rank - 12),
            justified=True,
            indistinguishable_from=(),
            caution=None,
            explanation="Friction grows with the load that the gear carries.",
            equation=effects()[name].equation,
            variable=effects()[name].variable,
            constants={},
        )
        for rank, name in enumerate(CANDIDATES, start=1)
    )
    joint = JointDiagnosis(
        joint="j1",
        verdict="missing",
        missing=("load-friction",),
        candidates=candidates,
        evidence=candidates[:1],
        where=(),
        noise_floor=0.01,
        structure=(),
        superfluous=(),
    )
    return DiagnosisDocument(
        experiment=EXPERIMENT,
        model="usual",
        relative_error=error,
        relative_error_with_missing=0.5 * error,
        noise_floor=0.01,
        joints=(joint,),
        not_applicable=(),
    )


def keep_figures(data: Path) -> None:
    """What the service does once a fit is stored."""
    folder = data / "experiments" / EXPERIMENT
    declared = read_experiment_file(folder / "experiment.yaml")
    store = SimpleNamespace(folder=lambda _: folder, declared=lambda _: declared)
    stored = StoredExperiment(store, EXPERIMENT)
    begun = time.perf_counter()
    for joint in stored.joint_names:
        make_figures(stored, joint)
    print(f"figures of the current model made in {1e3 * (time.perf_counter() - begun):.0f} ms\n")


@contextmanager
def service(data: Path) -> Iterator[str]:
    """A service that has just been started, at its address."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    process = subprocess.Popen(
        [sys.executable, "-m", "api", "serve", "--data", str(data), "--port", str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    address = f"http://127.0.0.1:{port}"
    try:
        while True:
            try:
                httpx.get(f"{address}/me").raise_for_status()
                break
            except httpx.TransportError:
                time.sleep(0.05)
        time.sleep(BETWEEN)
        yield address
    finally:
        process.terminate()
        process.wait(30)


def paint(data: Path, repeats: int, nothing_kept: bool) -> None:
    """Print each page's answer, first contentful paint and load, cold and warm."""
    from playwright.sync_api import sync_playwright

    head = (
        f"{'page':34}{'answer':>9}{'paint cold':>12}{'paint warm':>12}{'loaded':>9}{'of limit':>10}{'kB':>8}"
    )
    print(f"{head}   ms, median of {repeats}; load of the machine {os.getloadavg()[0]:.1f}")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        for name in PAGES:
            cold, warm = [], []
            for _ in range(repeats):
                if nothing_kept:
                    for kept in data.rglob(FOLDER):
                        shutil.rmtree(kept)
                with service(data) as address:
                    context = browser.new_context()
                    cold.append(_visit(context, f"{address}/pages/{name}"))
                    warm.append(_visit(context, f"{address}/pages/{name}"))
                    context.close()
            answer, painted, loaded, size = (statistics.median(column) for column in zip(*cold, strict=True))
            again = statistics.median(each[1] for each in warm)
            share = painted / PAINT_LIMIT
            print(
                f"{name:34}{answer:9.0f}{painted:12.0f}{again:12.0f}{loaded:9.0f}{share:9.2f}×{size / 1e3:8.0f}"
            )
        browser.close()


def _visit(context, address: str) -> tuple[float, float, float, float]:
    page = context.new_page()
    page.goto(address, wait_until="load")
    page.wait_for_function("() => performance.getEntriesByName('first-contentful-paint').length > 0")
    page.wait_for_load_state("networkidle")
    figures = page.evaluate(
        """() => {
            const navigation = performance.getEntriesByType("navigation")[0];
            const paint = performance.getEntriesByName("first-contentful-paint")[0];
            const sent = [navigation, ...performance.getEntriesByType("resource")];
            const size = sent.reduce((sum, each) => sum + each.transferSize, 0);
            return [navigation.responseEnd, paint.startTime, navigation.loadEventEnd, size];
        }"""
    )
    page.close()
    return tuple(figures)


LINK = f"/pages/experiments/{EXPERIMENT}/samples"
QUERY = {"joint": "j1", "version": "m2", "beside": "m1", "session": "session-00.csv", "points": 2400}


def first_look(address: str, folder: Path) -> float:
    """ms of the server's answer to the whole longest session, when nothing of it has been read since the machine began."""
    os.sync()
    for file in folder.rglob("*.npy"):
        with file.open("rb") as stream:
            os.posix_fadvise(stream.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
    with httpx.Client(base_url=address) as client:
        client.get("/me").raise_for_status()
        begun = time.perf_counter()
        client.get(LINK, params=QUERY).raise_for_status()
        return 1e3 * (time.perf_counter() - begun)


def zoom(address: str, samples: int, repeats: int, cold: float) -> None:
    """Print the time of the server's answer to zooms on the longest session, two models beside each other."""
    seconds = samples * 1e-3
    ranges = {
        "the whole session": {},
        "a tenth": {"start": 0.4 * seconds, "stop": 0.5 * seconds},
        "a second": {"start": 0.5 * seconds, "stop": 0.5 * seconds + 1},
    }
    print(
        f"\n{'zoom on ' + format(samples, ',') + ' samples':34}{'ms':>9}{'kB':>9}{'of limit':>10}   5 curves, median"
    )
    print(f"{'the whole session, from the disk':34}{cold:9.1f}{'':9}{cold / ZOOM_LIMIT:9.2f}×   once")
    with httpx.Client(base_url=address) as client:
        for words, window in ranges.items():
            taken, size = [], 0
            for _ in range(repeats):
                begun = time.perf_counter()
                answer = client.get(LINK, params=QUERY | window)
                taken.append(1e3 * (time.perf_counter() - begun))
                answer.raise_for_status()
                size = len(answer.content)
            median = statistics.median(taken)
            print(f"{words:34}{median:9.1f}{size / 1e3:9.1f}{median / ZOOM_LIMIT:9.2f}×")


if __name__ == "__main__":
    main()
