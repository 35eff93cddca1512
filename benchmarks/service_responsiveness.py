"""How long the service takes to answer while it identifies: computing in a process against computing in a
thread.

python benchmarks/service_responsiveness.py
"""

import statistics
import tempfile
import threading
import time
from pathlib import Path

import httpx
import numpy as np

import identify
from api.application import create_application
from api.client import Client
from api.server import ServiceServer, listen
from api.service.settings import ServiceSettings

SAMPLES = 120_000
ASKED_EVERY = 0.01
EXPERIMENT = """format: 1
name: busy
robot:
  gravity: [0.0, -9.81, 0.0]
  joints: [{name: j1, type: revolute, drive_gain: 10.0}]
payloads: [{name: none, mass: 0.0}]
sessions: [{file: session-00.csv, payload: none}]
"""


def write_experiment(folder: Path) -> None:
    """One long session of a pendulum with friction."""
    folder.mkdir(parents=True)
    time_axis = 0.002 * np.arange(SAMPLES)
    q, dq = np.sin(0.8 * time_axis), 0.8 * np.cos(0.8 * time_axis)
    command = (2.0 * -0.64 * q + 29.0 * np.cos(q) + 4.0 * dq + 5.0 * np.sign(dq)) / 10.0
    rows = np.column_stack([time_axis, q, command])
    np.savetxt(folder / "session-00.csv", rows, delimiter=",", header="t,q1,v1", comments="", fmt="%.7g")
    (folder / "experiment.yaml").write_text(EXPERIMENT)


def answers_while(http: httpx.Client, running: threading.Event) -> list[float]:
    """Times of small requests while something runs, ms."""
    took = []
    while running.is_set():
        begin = time.perf_counter()
        http.get("/me")
        took.append(1e3 * (time.perf_counter() - begin))
        time.sleep(ASKED_EVERY)
    return took


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder)
        experiment = data / "experiments" / "busy"
        write_experiment(experiment)
        application = create_application(ServiceSettings(data_folder=data))
        listening = listen("127.0.0.1", 0)
        server = ServiceServer(application, listening)
        thread = threading.Thread(target=server.run)
        thread.start()
        address = f"http://127.0.0.1:{listening.getsockname()[1]}"
        running = threading.Event()

        def in_process() -> None:
            with Client(address, timeout=120.0) as client:
                client.wait(client.fit("busy", "usual"))
                client.wait(client.diagnose("busy", client.models("busy").current or ""))
            running.clear()

        def in_thread() -> None:
            loaded = identify.load_experiment(experiment)
            identify.identify(loaded, model="usual")
            identify.diagnose(loaded, model="usual")
            running.clear()

        def at_rest() -> None:
            time.sleep(3.0)
            running.clear()

        with httpx.Client(base_url=address, timeout=120.0) as http:
            http.get("/me")
            print(f"answers to GET /me, ms{'':14} {'median':>8} {'99 %':>8} {'worst':>8} {'requests':>9}")
            medians = {}
            for name, work in (
                ("at rest", at_rest),
                ("process (ours)", in_process),
                ("thread (peer)", in_thread),
            ):
                running.set()
                worker = threading.Thread(target=work)
                worker.start()
                took = answers_while(http, running)
                worker.join()
                medians[name] = statistics.median(took)
                print(
                    f"  identifying: {name:20} {medians[name]:8.2f} {np.percentile(took, 99):8.1f} "
                    f"{max(took):8.1f} {len(took):9}"
                )
            print(
                f"thread against process, median: {medians['thread (peer)'] / medians['process (ours)']:.1f} x"
            )
        server.should_exit = True
        thread.join()
        listening.close()


if __name__ == "__main__":
    main()
