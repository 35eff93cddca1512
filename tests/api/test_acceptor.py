"""The acceptor and its connections, on a service that really listens in this process."""

import contextlib
import json
import socket
import threading
import time
from urllib.parse import urlsplit

import httpx
import pytest

from api import connections
from api.acceptor import WAITING_ROOM
from api.service.accounts import Role


def raw(listening, *pieces: bytes, timeout: float = 10.0) -> bytes:
    """What the service answers to these bytes, sent piece by piece, until it closes."""
    place = urlsplit(listening.address)
    with socket.create_connection((place.hostname, place.port), timeout=timeout) as connection:
        for piece in pieces:
            connection.sendall(piece)
        answer = b""
        while part := connection.recv(65536):
            answer += part
    return answer


def ask(connection: socket.socket, request: bytes) -> bytes:
    """One request on a kept connection; its whole answer, which is a JSON object."""
    connection.sendall(request)
    answer = b""
    while not answer.endswith(b"}"):
        part = connection.recv(4096)
        assert part, answer
        answer += part
    return answer


def test_a_stop_is_answered_while_the_event_loop_does_nothing(listening):
    """A new connection by the acceptor's own thread; who is unknown waits for the loop."""
    with httpx.Client(base_url=listening.address) as local:
        assert local.get("/me").json()["via"] == "local"
    frozen, thaw = threading.Event(), threading.Event()

    @listening.application.get("/frozen", include_in_schema=False)
    async def freeze() -> None:
        frozen.set()
        thaw.wait(20)

    thread = threading.Thread(target=httpx.get, args=(f"{listening.address}/frozen",), kwargs={"timeout": 30})
    thread.start()
    assert frozen.wait(20)
    try:
        answer = httpx.post(f"{listening.address}/pages/stop", timeout=2)
        assert answer.json() == {"stopped": [], "words": "Nothing was moving."}
        with pytest.raises(httpx.TimeoutException):
            httpx.get(f"{listening.address}/me", timeout=0.3)
    finally:
        thaw.set()
        thread.join()


def test_no_number_of_silent_connections_keeps_a_request_out(listening):
    place = urlsplit(listening.address)
    with contextlib.ExitStack() as held:
        for _ in range(2 * WAITING_ROOM):
            held.enter_context(socket.create_connection((place.hostname, place.port)))
        assert httpx.get(f"{listening.address}/me", timeout=10).status_code == 200
        assert httpx.post(f"{listening.address}/pages/stop", timeout=10).status_code == 200


def test_who_begins_a_request_and_does_not_go_on_is_shown_out(listening, monkeypatch):
    monkeypatch.setattr("api.acceptor.HEAD_TIMEOUT", 0.3)
    monkeypatch.setattr(connections, "HEAD_TIMEOUT", 0.3)
    begun = time.monotonic()
    assert raw(listening, b"GET /me HTTP/1.1\r\nHost: localhost\r\nX-Slow: a") == b""
    # Also on a kept connection, after an answer.
    answer = raw(listening, b"GET /me HTTP/1.1\r\nHost: localhost\r\n\r\n", b"GET /me HTTP/1.1\r\nX-Slow: a")
    assert answer.startswith(b"HTTP/1.1 200")
    assert time.monotonic() - begun < 8


def test_who_sends_a_body_byte_by_byte_is_shown_out_too(listening, monkeypatch):
    """Sixteen kilobytes that a stranger may send would else hold a place for days."""
    monkeypatch.setattr(connections, "BODY_TIMEOUT", 0.2)
    monkeypatch.setattr(connections, "SWEEP_EVERY", 0.05)
    place = urlsplit(listening.address)
    head = b"POST /sign-in HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 16000\r\n\r\n"
    with socket.create_connection((place.hostname, place.port)) as connection:
        connection.settimeout(0.02)
        connection.sendall(head)
        sent = 0
        with contextlib.suppress(ConnectionError):
            while sent < 15_000:
                connection.sendall(b" ")
                sent += 1
                with contextlib.suppress(TimeoutError):
                    if not connection.recv(1000):
                        break
    assert sent < 15_000


def test_what_was_read_before_a_connection_was_handed_over_is_not_lost(listening):
    """A body in the same packet as its head, and one that comes in pieces."""
    body = json.dumps({"name": "ada", "password": "correct horse battery"}).encode()
    listening.service.accounts.add_user("ada", "correct horse battery", Role.VIEWER)
    head = (
        b"POST /sign-in HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        b"Connection: close\r\nContent-Length: %d\r\n\r\n" % len(body)
    )
    for pieces in ((head + body,), (head, body), (head[:20], head[20:] + body[:5], body[5:])):
        answer = raw(listening, *pieces)
        assert answer.startswith(b"HTTP/1.1 200"), answer


@pytest.mark.parametrize(
    "bytes_",
    [
        b"\r\n\r\n",
        b"nonsense\r\n\r\n",
        b"\x16\x03\x01\x02\x00" * 4 + b"\r\n\r\n",
        b"POST /pages/stop\r\n\r\n",
    ],
)
def test_what_is_no_request_is_refused_and_harms_nobody(listening, bytes_):
    assert raw(listening, bytes_).startswith((b"HTTP/1.1 4", b""))
    assert httpx.get(f"{listening.address}/me", timeout=10).status_code == 200


def test_a_stop_with_a_body_and_in_pieces_is_a_stop(listening):
    httpx.get(f"{listening.address}/me")
    pieces = (b"POST /pages/st", b"op HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n\r\n", b"{}")
    assert b'"Nothing was moving."' in raw(listening, *pieces)
