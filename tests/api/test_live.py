"""Live views: one block for all, dropped for the slow, and never in the way of anything else."""

import asyncio
import json
import threading

import httpx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from api.service.accounts import Role
from api.service.live import BLOCKS_WAITING, Broadcast, decode_block, encode_block

RIG = "rx130l-joint3-simulated"
PASSWORD = "correct horse battery"


@given(rows=st.integers(0, 50), axes=st.integers(1, 6), origin=st.floats(0, 1e9))
def test_a_block_is_read_back_as_it_was_written(rows, axes, origin):
    values = np.random.default_rng(rows).normal(size=(1 + 3 * axes, rows)).astype(np.float32)
    back_origin, back, back_axes = decode_block(encode_block(origin, values, axes))
    assert back_origin == origin
    assert back_axes == axes
    np.testing.assert_array_equal(back, values)


async def _next_within_reach(viewer):
    return await asyncio.wait_for(viewer.next(), 5.0)


def test_a_slow_viewer_loses_the_oldest_blocks_and_a_quick_one_none():
    async def watch():
        broadcast = Broadcast()
        slow, quick = broadcast.join(), broadcast.join()
        seen = []
        for number in range(100):
            broadcast.send_block(bytes([number]))
            seen.append(await _next_within_reach(quick))
        late = [await _next_within_reach(slow) for _ in range(BLOCKS_WAITING)]
        return seen, late, slow.dropped, quick.dropped

    seen, late, slow_dropped, quick_dropped = asyncio.run(watch())
    assert seen == [bytes([number]) for number in range(100)]
    assert late == seen[-BLOCKS_WAITING:]
    assert slow_dropped == 100 - BLOCKS_WAITING
    assert quick_dropped == 0


def test_all_viewers_are_handed_the_same_bytes():
    async def watch():
        broadcast = Broadcast()
        viewers = [broadcast.join() for _ in range(20)]
        broadcast.send_block(block := b"x" * 1000)
        return [await _next_within_reach(viewer) is block for viewer in viewers]

    assert all(asyncio.run(watch()))


def test_only_the_newest_status_is_told_and_a_late_comer_hears_it_too():
    async def watch():
        broadcast = Broadcast()
        early = broadcast.join()
        for number in range(10):
            broadcast.send_status(str(number))
        late = broadcast.join()
        return await _next_within_reach(early), await _next_within_reach(late)

    assert asyncio.run(watch()) == ("9", "9")


@pytest.fixture
def address(listening):
    return listening.address.replace("http", "ws") + f"/rigs/{RIG}/live"


def test_who_looks_on_is_told_to_everybody_as_they_come_and_go(listening, address):
    def token(name):
        return {"Authorization": listening.client(Role.VIEWER, name).headers["Authorization"]}

    def until(connection, onlookers):
        while True:
            status = json.loads(connection.recv(timeout=20))
            if status["onlookers"] == onlookers:
                return

    with connect(address, additional_headers=token("ada")) as first:
        until(first, ["ada"])
        with connect(address, additional_headers=token("grace")) as second:
            until(second, ["ada", "grace"])
            until(first, ["ada", "grace"])
        until(first, ["ada"])


def test_without_a_sign_in_nobody_looks_on(listening, address):
    listening.client(Role.VIEWER)
    with pytest.raises(InvalidStatus) as refused, connect(address):
        pass
    assert refused.value.response.status_code == 403


def _revoke(listening, token):
    identifier = listening.service.accounts.tokens("vera")[0].id
    assert listening.service.accounts.revoke_token("vera", identifier)


def _expire(listening, token):
    listening.clock.advance(2 * 86400.0)


def _remove(listening, token):
    listening.service.accounts.remove_user("vera")


@pytest.mark.parametrize("end", [_revoke, _expire, _remove])
def test_a_connection_does_not_outlive_the_token_that_opened_it(listening, address, end):
    listening.client(Role.ADMIN)
    token = {"Authorization": listening.client(Role.VIEWER, "vera").headers["Authorization"]}
    with connect(address, additional_headers=token) as connection:
        connection.recv(timeout=20)
        end(listening, token)
        assert _closed_with(connection) == 1008


def test_a_connection_does_not_outlive_the_sign_in_that_opened_it(listening, address):
    listening.client(Role.VIEWER, "vera")
    with httpx.Client(base_url=listening.address) as browser:
        token = browser.post("/sign-in", json={"name": "vera", "password": PASSWORD}).json()["csrf_token"]
        cookie = {"Cookie": f"coulomb={browser.cookies['coulomb']}"}
        with connect(address, additional_headers=cookie) as connection:
            connection.recv(timeout=20)
            assert browser.post("/sign-out", headers={"X-CSRF-Token": token}).status_code < 300
            assert _closed_with(connection) == 1008


def test_the_operator_at_the_machine_is_out_once_there_is_an_account(listening, address):
    with connect(address) as connection:
        connection.recv(timeout=20)
        listening.service.accounts.add_user("ada", PASSWORD, Role.ADMIN)
        assert _closed_with(connection) == 1008


def _closed_with(connection) -> int | None:
    """The code with which the service closes a connection; what it still sends is read over."""
    try:
        while True:
            connection.recv(timeout=20)
    except ConnectionClosed as closed:
        return closed.rcvd.code if closed.rcvd else None


def test_the_stop_is_answered_while_every_other_thread_is_taken(listening, monkeypatch):
    release = threading.Event()
    waiting = threading.Semaphore(0)

    def slow_rows():
        waiting.release()
        release.wait(60)
        return []

    monkeypatch.setattr(listening.service.experiments, "rows", slow_rows)
    token = {"Authorization": listening.client(Role.VIEWER).headers["Authorization"]}

    def ask():
        httpx.get(f"{listening.address}/experiments", headers=token, timeout=60)

    threads = [threading.Thread(target=ask) for _ in range(60)]
    for thread in threads:
        thread.start()
    for _ in range(40):  # as many as the service has threads for requests
        assert waiting.acquire(timeout=30)
    try:
        answer = httpx.post(f"{listening.address}/rigs/{RIG}/stop", headers=token, timeout=10)
        assert answer.json() == {"stopped": False}
    finally:
        release.set()
        for thread in threads:
            thread.join(60)
