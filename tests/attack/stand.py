"""A service in a process of its own that moves a simulated rig in real time, and the axis in view from outside.

What the axis does is read from the acquisition's ring in shared memory, by this process and its own clock: no word of the
service is believed about when it came to rest.
"""

import contextlib
import os
import signal
import socket
import ssl
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import numpy as np
import yaml

from api.service.accounts import Accounts, Role
from api.service.database import open_database
from api.service.plan_store import PlanStore
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.trapezoid import Move
from daq.rig import RIGS
from daq.ring_buffer import RingReader

ROOT = Path(__file__).parents[2]
PASSWORD = "correct horse battery"
PEOPLE = {"ada": Role.OPERATOR, "vera": Role.VIEWER, "mallory": Role.VIEWER, "root": Role.ADMIN}
PATIENCE = 60.0
"""s for a step of the service on a busy machine"""
ATTEMPTS = 3
"""motions begun before an attack is given up"""
TURN = 0.002
"""s between looks at the ring"""
AT_REST = 2e-4
"""rad that a joint may still move in `STILL` s to count as at rest: 4 mrad/s"""
STILL = 0.05
CYCLE = 0.02
"""s, the rig's"""


RIG = f"attack-{os.getpid()}"
"""Name in the rig file, of which the ring's name is made; its id in the service is `bench`."""


def _ring_of_the_motion() -> RingReader:
    rings = sorted(Path("/dev/shm").glob(f"*{RIG}-*-rows"), key=lambda file: file.stat().st_mtime)
    return RingReader(rings[-1].name.removeprefix("coulomb-ring-"))


def free_port() -> int:
    """A port of this machine that nothing listens on now."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def long_plan() -> ExcitationPlan:
    """Back and forth at 0.5 rad/s for two minutes: it hardly ever stands still."""
    there, back = Move(to=(1.3,), duration=2.2, ramp=0.4), Move(to=(0.3,), duration=2.2, ramp=0.4)
    return ExcitationPlan(joints=("j3",), start=(0.3,), phases=(there, back) * 27, name="long")


@dataclass
class Axis:
    """The joint's position over this process's time, with the count of SYNCs, watched until `end` is set."""

    rows: list[tuple[float, float, int]] = field(default_factory=list)
    end: threading.Event = field(default_factory=threading.Event)

    def watch(self, ring: RingReader, to_joint: Callable[[float], float]) -> None:
        """Note every new row."""
        last = -1
        while not self.end.wait(TURN):
            newest = ring.latest(1)
            if len(newest) and newest["cycle"][0] != last:
                last = int(newest["cycle"][0])
                position = to_joint(float(newest["position"][0, 0]))
                self.rows.append((time.monotonic(), position, last))

    def speed_at(self, moment: float) -> float:
        """rad/s around a moment."""
        seen = np.array(self.rows)
        near = seen[np.abs(seen[:, 0] - moment) < 0.1]
        return float(np.abs(np.ptp(near[:, 1]) / np.ptp(near[:, 0]))) if len(near) > 2 else 0.0

    def rest_after(self, moment: float) -> float:
        """s from that moment until the joint did not move any more, counted in SYNCs: a time in which this computer let nothing
        run, the rig included, does not count."""
        seen = np.array(self.rows)
        final = seen[-1, 1]
        moved = seen[np.abs(seen[:, 1] - final) > AT_REST]
        begun = seen[seen[:, 0] <= moment][-1, 2]
        return float(moved[-1, 2] - begun) * CYCLE if len(moved) else 0.0


@dataclass
class Stand:
    """The running service."""

    address: str
    data: Path
    process: "subprocess.Popen[bytes]"
    tokens: dict[str, str]
    verify: "ssl.SSLContext | bool" = True
    browsers: list[httpx.Client] = field(default_factory=list)

    def client(self, name: str | None = None, timeout: float = PATIENCE) -> httpx.Client:
        """A client with that person's token, or without any."""
        headers = {} if name is None else {"Authorization": f"Bearer {self.tokens[name]}"}
        return httpx.Client(base_url=self.address, headers=headers, timeout=timeout, verify=self.verify)

    def browser(self, name: str) -> httpx.Client:
        """A browser that is signed in: cookie, origin, and the page's token."""
        client = self.client()
        self.browsers.append(client)
        answer = client.post("/sign-in", json={"name": name, "password": PASSWORD})
        assert answer.status_code == 200, answer.text
        client.headers.update(
            {
                "X-CSRF-Token": answer.json()["csrf_token"],
                "Origin": self.address,
                "Sec-Fetch-Site": "same-origin",
            }
        )
        return client

    def new_session(self, plan: str = "long") -> str:
        """A session of the experiment `arm`, which is made if need be; its address."""
        with self.client("ada") as ada:
            if ada.get("/experiments/arm").status_code == 404:
                answer = ada.post("/experiments", json={"name": "arm", "rig": "bench"})
                assert answer.status_code == 201, answer.text
            wanted = {"rig": "bench", "plan": plan, "payload": {"name": "none"}}
            answer = ada.post("/experiments/arm/sessions", json=wanted)
            assert answer.status_code == 201, answer.text
            return answer.headers["Location"]

    def take(self, session: str, *steps: str) -> None:
        """Take these steps of a session."""
        with self.client("ada") as ada:
            for step in steps:
                answer = ada.post(f"{session}/{step}", json={"mass": 0.0} if step == "weigh" else None)
                assert answer.status_code == 200, answer.text

    def session(self, session: str) -> dict:
        """What the service says of it."""
        with self.client("ada") as ada:
            return ada.get(session).json()

    def ended(self, session: str) -> dict:
        """Likewise, once it neither moves nor is about to."""
        wait_until(lambda: self.session(session)["state"] not in ("armed", "running"))
        return self.session(session)

    def discard(self, session: str) -> None:
        """Forget a session that was not measured."""
        with self.client("ada") as ada:
            ada.delete(session)

    def stop(self) -> None:
        """Stop the rig, by a program."""
        with self.client("vera") as vera:
            assert vera.post("/rigs/bench/stop").is_success

    @contextlib.contextmanager
    def motion(self) -> Iterator[Axis]:
        """The rig moves fast; the axis is watched until the block ends.

        A motion that ends before it was attacked, because this computer was held up, is begun once more.
        """
        for _ in range(ATTEMPTS):
            session = self.new_session()
            self.take(session, "check", "weigh", "confirm", "arm", "start")
            with self.watched() as axis:
                if self._moves_fast(axis, session):
                    yield axis
                    return
        raise AssertionError("this computer has too much else to do for a motion in real time")

    def _moves_fast(self, axis: Axis, session: str) -> bool:
        """Wait until the axis moves fast; False if the session ended before."""
        found: list[str] = []

        def fast_or_ended() -> bool:
            state = self.session(session)
            if state["state"] not in ("armed", "running"):
                found.append(f"{state['state']}: {state['reason']}")
            return bool(found) or (len(axis.rows) > 50 and axis.speed_at(axis.rows[-1][0]) > 0.3)

        wait_until(fast_or_ended)
        if found:
            print(f"\n{session} {found[0]}")
        return not found

    @contextlib.contextmanager
    def watched(self) -> Iterator[Axis]:
        """The axis of the session that was armed last, watched until the block ends."""
        ring = _ring_of_the_motion()
        scale = 2 * np.pi / 131072 / 95.0
        axis = Axis()
        thread = threading.Thread(target=axis.watch, args=(ring, lambda counts: counts * scale))
        thread.start()
        try:
            yield axis
        finally:
            axis.end.set()
            thread.join()
            ring.close()


def wait_until(condition: Callable[[], bool], timeout: float = PATIENCE) -> None:
    """Return once the condition holds."""
    latest, pause = time.monotonic() + timeout, threading.Event()
    while not condition():
        assert time.monotonic() < latest, "it did not happen in time"
        pause.wait(0.01)


def comes_to_rest(axis: Axis, after: float = 0.3, timeout: float = PATIENCE) -> None:
    """Return once the joint has not moved for `after` s."""

    def still() -> bool:
        # The ring may have ended with the session: no row is no motion either.
        now = time.monotonic()
        recent = [position for moment, position, _cycle in axis.rows if now - moment < after]
        return not recent or max(recent) - min(recent) < AT_REST

    wait_until(still, timeout)


@contextlib.contextmanager
def running_service(
    folder: Path,
    *,
    descriptors: int = 1024,
    tls: tuple[Path, Path] | None = None,
    plans: tuple[ExcitationPlan, ...] | None = None,
) -> Iterator[Stand]:
    """Start the service on a data folder of its own, with accounts and plans; ended at the end, whatever happened."""
    data = folder / "data"
    (data / "rigs").mkdir(parents=True)
    rig = yaml.safe_load((RIGS / "rx130l-joint3-simulated.yaml").read_text())
    rig |= {"name": RIG, "pacing": "real-time", "cycle": CYCLE}
    # A bus in this process, on a computer that has other work as well, is late now and again.
    rig["supervision"] = {"silence": 0.5, "heartbeat_timeout": 1.5}
    rig["bus"]["channel"] = RIG
    (data / "rigs" / "bench.yaml").write_text(yaml.safe_dump(rig))
    for plan in plans or (long_plan(),):
        PlanStore(data / "plans").add(plan)
    database = open_database(data, None)
    accounts = Accounts(database, time.time)
    tokens = {}
    for name, role in PEOPLE.items():
        accounts.add_user(name, PASSWORD, role)
        tokens[name] = accounts.issue_token(name, "attack", role, 86400.0).secret
    database.close()
    port, extra = free_port(), []
    if tls is not None:
        extra = [str(tls[0]), str(tls[1]), str(free_port())]
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.attack.serve", str(data), str(port), str(descriptors), *extra], cwd=ROOT
    )
    scheme, verify = "http", True
    if tls is not None:
        scheme, verify = "https", ssl.create_default_context(cafile=tls[0])
    stand = Stand(f"{scheme}://localhost:{port}", data, process, tokens, verify)
    try:
        wait_until(lambda: _answers(stand))
        yield stand
    finally:
        for browser in stand.browsers:
            browser.close()
        process.send_signal(signal.SIGCONT)
        process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(20)
        process.kill()
        process.wait()


def _answers(stand: Stand) -> bool:
    assert stand.process.poll() is None, "the service ended"
    try:
        with stand.client("vera", timeout=2.0) as client:
            return client.get("/me").status_code == 200
    except httpx.HTTPError:
        return False
