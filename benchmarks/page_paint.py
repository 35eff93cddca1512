"""First paint of every page, and a zoom on a million samples: how long a person waits.

A service with one experiment of three sessions, one of them a million samples long, is asked by Chromium as a person's
browser asks it: cold (a service that has just been started, and a browser without a cache) and warm. Printed: the server's
answer, first contentful paint and everything loaded, in ms, against the limit of 500 ms, and the kB that travelled against
300 kB; then the server's time for a zoom against 150 ms. The figures of the fits were made when they were stored, as the
service does; with --nothing-kept they are those of an older version, and made for whoever comes first. With --sessions it
is a robot of six joints with so many recordings of 60 s.

    python benchmarks/page_paint.py [--samples 1000000] [--repeats 5] [--sessions 0] [--nothing-kept]
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
from stored_experiment import Stored, long_session, many_sessions, write_experiment

from api.pages.figures_ahead import make_figures
from api.pages.kept_numbers import FOLDER
from api.pages.stored_models import StoredExperiment
from identify.recording.experiment_file import read_experiment_file

PAINT_LIMIT = 500.0  # ms
BETWEEN = 1.0  # s from the service's first answer to the first page
ZOOM_LIMIT = 150.0  # ms
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
    "records",
    "experiments/{}/sessions",
    "experiments/{}/model",
    "experiments/{}/model?session={}",
    "experiments/{}/model?beside=m1",
    "experiments/{}/missing",
    "experiments/{}/results",
    "experiments/{}/report",
    "account",
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=1_000_000)
    parser.add_argument("--sessions", type=int, default=0, help="of a robot of six joints instead, 60 s each")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--nothing-kept", action="store_true")
    options = parser.parse_args()
    stored = many_sessions(options.sessions) if options.sessions else long_session(options.samples)
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder)
        write_experiment(data / "experiments" / stored.name, stored)
        if not options.nothing_kept:
            keep_figures(data, stored)
        if CHROMIUM is None:
            print("No Chromium here (Debian package chromium): only the server is measured.")
        else:
            paint(data, stored, options.repeats, options.nothing_kept)
        with service(data) as address:
            cold = first_look(address, data, stored)
            zoom(address, stored, options.repeats, cold)


def keep_figures(data: Path, made: Stored) -> None:
    """What the service does once a fit is stored."""
    folder = data / "experiments" / made.name
    declared = read_experiment_file(folder / "experiment.yaml")
    store = SimpleNamespace(folder=lambda _: folder, declared=lambda _: declared)
    stored = StoredExperiment(store, made.name)
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


def paint(data: Path, stored: Stored, repeats: int, nothing_kept: bool) -> None:
    """Print each page's answer, first contentful paint and load, cold and warm."""
    from playwright.sync_api import sync_playwright

    head = (
        f"{'page':34}{'answer':>9}{'paint cold':>12}{'paint warm':>12}{'loaded':>9}{'of limit':>10}{'kB':>8}"
    )
    print(f"{head}   ms, median of {repeats}; load of the machine {os.getloadavg()[0]:.1f}")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        for address_of in PAGES:
            name = address_of.format(stored.name, next(iter(stored.sessions)))
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
            share, page = painted / PAINT_LIMIT, name.partition("/")[2] or name
            print(
                f"{page:34}{answer:9.0f}{painted:12.0f}{again:12.0f}{loaded:9.0f}{share:9.2f}×{size / 1e3:8.0f}"
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


def _query(stored: Stored) -> tuple[str, dict[str, str | int]]:
    """Where the longest session's samples are asked for, of both models, and how."""
    query: dict[str, str | int] = {"joint": stored.joints[0], "version": "m2", "beside": "m1", "points": 2400}
    return f"/pages/experiments/{stored.name}/samples", query | {"session": next(iter(stored.sessions))}


def first_look(address: str, folder: Path, stored: Stored) -> float:
    """ms of the server's answer to the whole longest session, when nothing of it has been read since the machine began."""
    os.sync()
    link, query = _query(stored)
    for file in folder.rglob("*.npy"):
        with file.open("rb") as stream:
            os.posix_fadvise(stream.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
    with httpx.Client(base_url=address) as client:
        client.get("/me").raise_for_status()
        begun = time.perf_counter()
        client.get(link, params=query).raise_for_status()
        return 1e3 * (time.perf_counter() - begun)


def zoom(address: str, stored: Stored, repeats: int, cold: float) -> None:
    """Print the time of the server's answer to zooms on the longest session, two models beside each other."""
    link, query = _query(stored)
    samples = next(iter(stored.sessions.values()))[1]
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
                answer = client.get(link, params=query | window)
                taken.append(1e3 * (time.perf_counter() - begun))
                answer.raise_for_status()
                size = len(answer.content)
            median = statistics.median(taken)
            print(f"{words:34}{median:9.1f}{size / 1e3:9.1f}{median / ZOOM_LIMIT:9.2f}×")


if __name__ == "__main__":
    main()
