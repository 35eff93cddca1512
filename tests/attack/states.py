"""States of a service in which a stop must come through: context managers of a `Stand`, each one thing that goes wrong."""

import contextlib
import io
import socket
import sqlite3
import threading
import zipfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlsplit

import httpx
from websockets.sync.client import connect

from tests.attack.stand import Stand, wait_until

State = Callable[[Stand], contextlib.AbstractContextManager[object]]
BOMB_SETTINGS = """format: 1
name: bomb
robot: {gravity: [0.0, -9.81, 0.0], joints: [{name: j1, type: revolute, drive_gain: 10.0}]}
payloads: [{name: none, mass: 0.0}]
sessions: [{file: a.csv, payload: none}]
"""


@contextlib.contextmanager
def healthy(stand: Stand) -> Iterator[None]:
    """Nothing is wrong."""
    yield


@contextlib.contextmanager
def descriptors_out(stand: Stand) -> Iterator[None]:
    """1100 connections of somebody who says nothing, where the service has 1024 descriptors."""
    place = urlsplit(stand.address)
    with contextlib.ExitStack() as held:
        for _ in range(1100):
            crowd = socket.socket()
            held.enter_context(crowd)
            crowd.settimeout(5)
            with contextlib.suppress(OSError):  # turned away
                crowd.connect((place.hostname, place.port))
        yield


@contextlib.contextmanager
def half_requests(stand: Stand) -> Iterator[None]:
    """600 connections that begin a request and never end it, of which one byte comes now and again."""
    place = urlsplit(stand.address)
    ended = threading.Event()
    with contextlib.ExitStack() as held:
        crowd = []
        for _ in range(600):
            each = socket.socket()
            held.enter_context(each)
            each.settimeout(5)
            with contextlib.suppress(OSError):
                each.connect((place.hostname, place.port))
                each.send(b"GET /me HTTP/1.1\r\nHost: localhost\r\nX-Slow: ")
                crowd.append(each)

        def dribble() -> None:
            while not ended.wait(0.2):
                for each in crowd:
                    with contextlib.suppress(OSError):
                        each.send(b"a")

        thread = threading.Thread(target=dribble)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()


@contextlib.contextmanager
def loop_frozen(stand: Stand) -> Iterator[None]:
    """A handler sleeps in the event loop."""
    with ThreadPoolExecutor(1) as pool, stand.client(timeout=10) as mallory:
        pool.submit(mallory.post, "/freeze/4")
        wait_until(lambda: not _answers_within(stand, 0.1), 10)
        yield


def _answers_within(stand: Stand, timeout: float) -> bool:
    try:
        with stand.client("vera", timeout=timeout) as client:
            return client.get("/me").is_success
    except httpx.HTTPError:
        return False


@contextlib.contextmanager
def database_locked(stand: Stand) -> Iterator[None]:
    """Another process writes and does not come to an end."""
    with contextlib.closing(sqlite3.connect(stand.data / "service.sqlite", isolation_level=None)) as database:
        database.execute("BEGIN EXCLUSIVE")
        yield
        database.execute("ROLLBACK")


@contextlib.contextmanager
def sixty_viewers(stand: Stand) -> Iterator[None]:
    """60 live views, of which half never read."""
    with contextlib.ExitStack() as held:
        for number in range(60):
            address = stand.address.replace("http", "ws", 1) + "/rigs/bench/live"
            token = stand.tokens["vera"]
            viewer = connect(address, additional_headers={"Authorization": f"Bearer {token}"})
            held.callback(viewer.close_socket)
            if number % 2:
                threading.Thread(target=_read_all, args=(viewer,), daemon=True).start()
        yield


def _read_all(viewer) -> None:
    with contextlib.suppress(Exception):
        while True:
            viewer.recv()


@contextlib.contextmanager
def upload_bombs(stand: Stand) -> Iterator[None]:
    """Somebody uploads, again and again, what is small and unpacks to 600 MB."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("experiment.yaml", BOMB_SETTINGS)
        with archive.open("a.csv", "w", force_zip64=True) as member:
            member.write(b"t,q1,v1\n")
            for _ in range(600):
                member.write(b"0,0,0\n" * 170_000)
    end, content = threading.Event(), packed.getvalue()

    def upload() -> None:
        with stand.client("ada") as ada:
            while not end.is_set():
                with contextlib.suppress(httpx.HTTPError):
                    ada.post("/experiments/import", files={"file": ("a.zip", content)})

    with _threads(upload, end):
        yield


@contextlib.contextmanager
def header_bombs(stand: Stand) -> Iterator[None]:
    """Strangers send heads of thousands of fields on 100 connections, as fast as they are taken."""
    place = urlsplit(stand.address)
    bomb = (
        b"GET /me HTTP/1.1\r\nHost: localhost\r\n"
        + b"".join(b"x%d:\r\n" % number for number in range(4000))
        + b"\r\n"
    )
    end = threading.Event()

    def throw() -> None:
        while not end.is_set():
            with contextlib.suppress(OSError), contextlib.ExitStack() as crowd:
                for _ in range(100):
                    each = crowd.enter_context(
                        socket.create_connection((place.hostname, place.port), timeout=2)
                    )
                    each.sendall(bomb)

    with _threads(throw, end):
        yield


@contextlib.contextmanager
def talking_viewers(stand: Stand) -> Iterator[None]:
    """Four live views whose other side sends frames as fast as they are taken."""
    address = stand.address.replace("http", "ws", 1) + "/rigs/bench/live"
    end = threading.Event()

    def talk() -> None:
        while not end.is_set():
            with (
                contextlib.suppress(Exception),
                connect(
                    address, additional_headers={"Authorization": f"Bearer {stand.tokens['vera']}"}
                ) as viewer,
            ):
                while not end.is_set():
                    viewer.socket.sendall(b"\x89\x80\0\0\0\0" * 10_000)

    with _threads(talk, end, 4):
        yield


@contextlib.contextmanager
def _threads(work: Callable[[], None], end: threading.Event, count: int = 1) -> Iterator[None]:
    threads = [threading.Thread(target=work) for _ in range(count)]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        end.set()
        for thread in threads:
            thread.join()


@contextlib.contextmanager
def jobs_full(stand: Stand) -> Iterator[None]:
    """More plans to be computed than anybody waits for."""
    with stand.client("ada") as ada:
        for number in range(40):
            ada.post("/plans", json={"rig": "bench", "name": f"p{number}", "seconds": 60, "model": "usual"})
        yield


STATES = (
    healthy,
    descriptors_out,
    half_requests,
    loop_frozen,
    database_locked,
    sixty_viewers,
    jobs_full,
    upload_bombs,
    header_bombs,
    talking_viewers,
)
