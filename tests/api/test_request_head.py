"""Heads of requests that cost more than they say: turned away unparsed; and the forms in which one request can be written."""

import socket
import struct
from types import SimpleNamespace
from urllib.parse import urlsplit

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from api.application import create_application
from api.connections import Connections
from api.quiet_websocket import SAID_AT_ONCE
from api.request_head import (
    LONGEST_HEAD,
    LONGEST_TARGET,
    MOST_COOKIES,
    MOST_FIELDS,
    head_of,
    in_origin_form,
    objection_to,
    request_of,
)
from api.service.settings import ServiceSettings
from api.turnstile import Turnstile
from tests.api.served import served
from tests.api.test_acceptor import ask, raw


@pytest.fixture(scope="module")
def listening(tmp_path_factory):
    """A service on uvicorn that all tests of this module attack."""
    application = create_application(ServiceSettings(data_folder=tmp_path_factory.mktemp("data")))
    with served(application) as address:
        yield SimpleNamespace(address=address)


GET = b"GET /me HTTP/1.1\r\nHost: localhost\r\n"
BOMBS = {
    "many fields": (431, GET + b"a:\r\n" * MOST_FIELDS),
    "long": (431, GET + b"a: " + b"x" * LONGEST_HEAD),
    "many cookies": (431, GET + b"Cookie: " + b"a;" * (MOST_COOKIES + 1) + b"\r\n"),
    "long address": (414, b"GET /me?" + b"a=&" * LONGEST_TARGET + b" HTTP/1.1\r\nHost: localhost\r\n"),
    "two ends": (400, GET + b"Content-Length: 3\r\nTransfer-Encoding: chunked\r\n"),
    "two ends, oddly spelt": (400, GET + b"content-LENGTH:3\r\nTRANSFER-encoding :chunked\r\n"),
}


@pytest.mark.parametrize("bomb", list(BOMBS))
def test_a_bomb_is_turned_away_at_the_first_request_and_on_a_kept_connection(listening, bomb):
    status, head = BOMBS[bomb]
    answer = raw(listening, head + b"\r\n")
    assert answer.startswith(b"HTTP/1.1 %d" % status)
    assert b"X-Content-Type-Options: nosniff" in answer
    place = urlsplit(listening.address)
    with socket.create_connection((place.hostname, place.port), timeout=10) as kept:
        assert ask(kept, GET + b"\r\n").startswith(b"HTTP/1.1 200")
        assert ask(kept, head + b"\r\n").startswith(b"HTTP/1.1 %d" % status)


@pytest.mark.parametrize("bomb", [bomb for bomb in BOMBS if bomb != "long"])
def test_a_bomb_is_refused_before_the_event_loop_hears_of_it(listening, monkeypatch, bomb):
    """A way into the loop costs ten times the look at its bytes, and a busy loop holds up the thread that answers stops."""
    monkeypatch.setattr(
        Connections, "admit", lambda *_arguments: pytest.fail("it was handed to the event loop")
    )
    status, head = BOMBS[bomb]
    assert raw(listening, head + b"\r\n").startswith(b"HTTP/1.1 %d" % status)


def test_bombs_of_who_is_gone_before_the_answer_fill_no_log(listening, caplog):
    place = urlsplit(listening.address)
    for _ in range(20):
        with socket.create_connection((place.hostname, place.port), timeout=10) as gone:
            gone.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # closed by a reset
            gone.sendall(BOMBS["many fields"][1] + b"\r\n")
    assert httpx.get(f"{listening.address}/me", timeout=10).status_code == 200
    assert "Exception in callback" not in caplog.text


def test_what_a_browser_with_much_to_say_sends_is_taken(listening):
    cookies = {f"cookie{number}": "x" * 50 for number in range(MOST_COOKIES // 2)}
    headers = {f"X-Field-{number}": "y" * 100 for number in range(MOST_FIELDS // 2)}
    headers["Origin"] = listening.address
    with httpx.Client(base_url=listening.address, cookies=cookies, headers=headers) as client:
        assert client.get("/me?" + "z" * 4000).status_code == 200
        assert client.post("/pages/stop").status_code == 200


@pytest.mark.parametrize(
    "head",
    [
        b"POST http://localhost/pages/stop HTTP/1.1\r\nHost: elsewhere\r\n\r\n",
        b"POST HTTP://127.0.0.1:80/pages/stop?x HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"POST /pages/stop HTTP/1.1\nHost: localhost\n\n",
        b"POST /pages/stop HTTP/1.0\r\n\r\n",
    ],
    ids=["absolute", "absolute, query", "LF alone", "1.0 without a host"],
)
def test_every_way_to_write_a_stop_is_one(listening, head):
    httpx.get(f"{listening.address}/me")
    assert b'"Nothing was moving."' in raw(listening, head)
    # On a kept connection, which the event loop has.
    place = urlsplit(listening.address)
    with socket.create_connection((place.hostname, place.port), timeout=10) as kept:
        ask(kept, GET + b"\r\n")
        assert b"Nothing was moving." in ask(kept, head)


def test_a_stop_on_a_kept_connection_is_obeyed_when_it_is_read_and_waits_for_no_turn(listening, monkeypatch):
    """The event loop may freeze between reading a request and its turn, where nobody can look into it any more."""
    place = urlsplit(listening.address)
    with socket.create_connection((place.hostname, place.port), timeout=10) as kept:
        ask(kept, GET + b"\r\n")
        monkeypatch.setattr(Turnstile, "wait", lambda *_arguments, **_named: None)
        answer = ask(kept, b"POST /pages/stop HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n\r\n{}")
    assert b"Nothing was moving." in answer


def test_the_host_of_an_address_in_absolute_form_is_the_one_that_counts(listening):
    head = b"GET http://evil.example/me HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
    assert b"not called 'evil.example'" in raw(listening, head)
    head = b"GET http://localhost/me HTTP/1.1\r\nHost: evil.example\r\nConnection: close\r\n\r\n"
    assert b'"via":"local"' in raw(listening, head)


@given(st.binary(max_size=300))
def test_no_bytes_are_too_odd_to_be_judged(read):
    head = head_of(read + b"\r\n\r\n")
    assert head is not None
    objection_to(head)
    request_of(read + b"\r\n\r\n")
    scope = {"type": "http", "path": "/", "raw_path": b"http://" + read, "headers": [(b"host", b"x")]}
    assert in_origin_form(scope)["path"].startswith("/")


def _read_to_the_end(viewer):
    while True:
        viewer.recv(10)


@pytest.mark.parametrize("frame", [b"\x89\x80\0\0\0\0", b"\x81\x81\0\0\0\0a"], ids=["pings", "messages"])
def test_who_talks_into_a_live_view_is_not_listened_to(listening, frame):
    """Every frame costs its parsing, and all of it in the event loop."""
    address = listening.address.replace("http", "ws", 1) + "/rigs/rx130l-joint3-simulated/live"
    with connect(address) as viewer:
        viewer.ping().wait(10)  # a little is
        viewer.recv(10)
        viewer.socket.sendall(frame * SAID_AT_ONCE)
        with pytest.raises(ConnectionClosed):
            _read_to_the_end(viewer)
    assert httpx.get(f"{listening.address}/me", timeout=10).status_code == 200
