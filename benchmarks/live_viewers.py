"""A session in real time with nobody looking on and with twenty viewers: does the acquisition notice?

    python benchmarks/live_viewers.py [--viewers 20] [--seconds 20]

The rig is the simulated RX130L joint 3, paced in real time at 2 ms. One of the viewers opens a live view
and never reads. Printed are cycles that are incomplete in the recording, the spread of the SYNC period, and
the processor time that the service itself used.
"""

import argparse
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import h5py
import numpy as np
import yaml
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

import config
from api.client import Client

RIG = "rx130l-joint3-simulated"


def main() -> None:
    """Measure and print."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--viewers", type=int, default=20)
    options.add_argument("--seconds", type=float, default=20.0)
    chosen = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder)
        (data / "rigs").mkdir(parents=True)
        rig = yaml.safe_load((Path(config.__file__).parent / "rigs" / f"{RIG}.yaml").read_text())
        (data / "rigs" / f"{RIG}.yaml").write_text(yaml.safe_dump(rig | {"pacing": "real-time"}))
        command = [sys.executable, "-m", "api", "serve", "--port", "0", "--data", str(data)]
        service = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        assert service.stderr is not None
        address = service.stderr.readline().split()[2].rstrip("/")
        try:
            with Client(address, timeout=120.0) as client:
                job = client.wait(client.make_plan(RIG, "plan", chosen.seconds, "usual"))
                client.create_experiment("viewers", RIG)
                print(
                    f"{'viewers':>8} {'cycles':>8} {'incomplete':>11} {'SYNC period ms':>16} {'spread ms':>10} "
                    f"{'worst ms':>9} {'blocks each':>12} {'service, % of a core':>21}"
                )
                plain = measure(client, service.pid, address, data, job.result.plan, 0)
                crowded = measure(client, service.pid, address, data, job.result.plan, chosen.viewers)
                print(f"ratio of spreads {crowded / plain:.2f}; load of the machine {os.getloadavg()[0]:.1f}")
        finally:
            service.terminate()
            service.wait()


def measure(client: Client, process: int, address: str, data: Path, plan: str, viewers: int) -> float:
    """One session; returns the spread of the SYNC period in ms."""
    session = client.create_session("viewers", RIG, plan, "none").id
    client.step("viewers", session, "weigh", mass=0.0)
    check = client.step("viewers", session, "check")
    if not check.ok:
        raise SystemExit(f"the rig is not ready: {check.items}")
    client.step("viewers", session, "confirm")
    client.step("viewers", session, "arm")
    live = address.replace("http", "ws") + f"/rigs/{RIG}/live"
    seen: list[int] = []
    crowd = [
        threading.Thread(target=look, args=(live, seen), daemon=True) for _ in range(max(viewers - 1, 0))
    ]
    for thread in crowd:
        thread.start()
    idle = idle_viewer(address) if viewers else None
    client.step("viewers", session, "start")
    before = processor_seconds(process)
    begin = time.monotonic()
    while client.session("viewers", session).state in ("armed", "running"):
        time.sleep(0.5)
    used = (processor_seconds(process) - before) / (time.monotonic() - begin)
    for thread in crowd:
        thread.join(10.0)
    if idle is not None:
        idle.close()
    state = client.session("viewers", session)
    if state.file is None:
        raise SystemExit(f"the session was not recorded: {state.state}, {state.reason}")
    with h5py.File(data / "experiments" / "viewers" / state.file) as recording:
        periods = np.diff(recording["sync_time"][:]) * 1e-6
        valid = recording["valid"][:]
        cycles = len(valid)
        incomplete = int(((valid & 3) != 3).any(axis=1).sum())
    for job in client.jobs("viewers"):
        None if job.state.final else client.wait(job)
    blocks = f"{min(seen)} to {max(seen)}" if seen else "-"
    print(
        f"{viewers:8} {cycles:8} {incomplete:11} {periods.mean():16.4f} {periods.std():10.4f} "
        f"{periods.max():9.2f} {blocks:>12} {100 * used:21.1f}"
    )
    if state["state"] != "done":
        print(f"         ended early: {state.state}, {state.reason}")
    return float(periods.std())


def look(address: str, seen: list[int]) -> None:
    """A viewer that takes everything until the session has ended."""
    blocks = 0
    try:
        with connect(address, max_size=None) as connection:
            for message in connection:
                if isinstance(message, bytes):
                    blocks += 1
                elif json.loads(message)["session"]["state"] in ("done", "aborted", "faulted"):
                    break
    except ConnectionClosed:
        pass
    seen.append(blocks)


def idle_viewer(address: str) -> socket.socket:
    """A viewer that opens a live view and never reads a byte after the handshake."""
    host, _, port = address.removeprefix("http://").partition(":")
    connection = socket.create_connection((host, int(port)))
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.sendall(
        f"GET /rigs/{RIG}/live HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    return connection


def processor_seconds(process: int) -> float:
    """User and system time that a process has used, s."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()
