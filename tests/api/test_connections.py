"""Connections that the event loop serves: room for so many, and for how long."""

import asyncio
import contextlib
import socket
import ssl
import threading
from urllib.parse import urlsplit

import uvicorn
from uvicorn.server import ServerState

from api import connections
from api.connections import Link
from tests.api.test_acceptor import ask


def test_there_is_room_for_so_many_and_the_longest_idle_makes_room(listening):
    place = urlsplit(listening.address)
    request = b"GET /me HTTP/1.1\r\nHost: localhost\r\n\r\n"
    kept = []
    with contextlib.ExitStack() as held:
        for _ in range(connections.MOST_CONNECTIONS // 2 + 20):
            each = held.enter_context(socket.create_connection((place.hostname, place.port), timeout=20))
            assert ask(each, request).startswith(b"HTTP/1.1 200")
            kept.append(each)
        assert kept[0].recv(4096) == b""  # shown out
        assert ask(kept[-1], request).startswith(b"HTTP/1.1 200")


def test_a_request_that_goes_on_for_nobody_holds_others_up_only_until_it_ends(listening, monkeypatch):
    held, asked = threading.Event(), threading.Event()

    @listening.application.get("/held", include_in_schema=False)
    def hold() -> dict:
        asked.set()
        held.wait(20)
        return {}

    monkeypatch.setattr("api.turnstile.MOST_ABANDONED", 1)
    place = urlsplit(listening.address)
    head = b"GET %s HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
    with socket.create_connection((place.hostname, place.port)) as leaving:
        leaving.sendall(head % b"/held")
        assert asked.wait(20)
    with socket.create_connection((place.hostname, place.port), timeout=20) as following:
        following.sendall(head % b"/me")
        held.set()
        assert following.recv(100).startswith(b"HTTP/1.1 200")


def test_who_waits_for_an_answer_makes_room_for_nobody_and_who_left_is_not_counted():
    answering = asyncio.Event()

    async def application(_scope, _receive, send) -> None:
        await answering.wait()
        await send({"type": "http.response.start", "status": 204, "headers": []})
        await send({"type": "http.response.body"})

    async def crowd() -> None:
        loop = asyncio.get_running_loop()
        state = ServerState()
        config = uvicorn.Config(application, lifespan="off", log_config=None)
        admitted = connections.Connections(config, state, 4)
        admitted.start({})
        far: list[socket.socket] = []

        def comes(address: str) -> bool:
            near, other = socket.socketpair()
            far.append(other)
            for each in (near, other):
                each.setblocking(False)
            if admitted.admit(Link(near, address, b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")):
                return True
            near.close()
            return False

        assert comes("a")
        assert comes("a")
        while len(state.tasks) < 2:
            await asyncio.sleep(0)
        assert not comes("a")  # half of all are theirs, and both wait for an answer
        assert comes("b")
        answering.set()
        for each in far[:2]:
            assert (await loop.sock_recv(each, 100)).startswith(b"HTTP/1.1 204")
        assert comes("a")  # in the place of the one that has been idle longest
        assert await loop.sock_recv(far[0], 100) == b""
        for each in far:
            each.close()
        while state.connections:
            await asyncio.sleep(0)
        assert [comes("a") for _ in range(2)] == [True, True]
        while len(state.connections) < 2:
            await asyncio.sleep(0)
        admitted.end()
        for each in far:
            each.close()
        while state.connections:
            await asyncio.sleep(0)

    asyncio.run(crowd())


def test_a_peek_reads_nothing_and_needs_no_descriptor():
    ours, theirs = socket.socketpair()
    with ours, theirs:
        link = Link(ours, "")
        assert link.peek() == b""
        theirs.sendall(b"POST /pages/stop HTTP/1.1\r\n\r\n")
        assert link.peek() == link.peek() == b"POST /pages/stop HTTP/1.1\r\n\r\n"
        assert ours.recv(4) == b"POST"
    assert link.gone
    assert link.peek() == b""


def test_whoever_never_goes_on_with_a_tls_handshake_makes_room_too():
    async def crowd() -> None:
        config = uvicorn.Config(lambda *_arguments: None, lifespan="off", log_config=None)
        admitted = connections.Connections(config, ServerState(), 4)
        admitted.start({})
        far: list[socket.socket] = []
        for _ in range(5):
            near, other = socket.socketpair()
            far.append(other)
            for each in (near, other):
                each.setblocking(False)
            link = Link(near, "a")
            assert admitted.admit(link, ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER))
            while link.protocol is None:
                await asyncio.sleep(0)
        assert await asyncio.get_running_loop().sock_recv(far[0], 100) == b""
        admitted.end()
        for each in far:
            each.close()
        while any(not link.gone for link in admitted.served()):
            await asyncio.sleep(0)

    asyncio.run(crowd())
