"""Requests that the guard refuses, and what it writes on every response."""

from types import SimpleNamespace

import anyio
import pytest
from starlette.requests import HTTPConnection

from api.service import guard
from api.service.accounts import Role

PASSWORD = "correct horse battery"


@pytest.fixture
def ada(service):
    service.service.accounts.add_user("ada", PASSWORD, Role.OPERATOR)
    return service


# --- CSRF and other sites


@pytest.mark.parametrize("header", [None, "wrong"])
def test_a_change_without_the_pages_token_is_refused(ada, header):
    browser = ada.browser("ada")
    del browser.headers["X-CSRF-Token"]
    headers = {} if header is None else {"X-CSRF-Token": header}
    answer = browser.post("/rigs/rx130l-joint3-simulated/take", headers=headers)
    assert answer.status_code == 403
    assert "load the page again" in answer.json()["detail"]


def test_a_page_of_another_site_changes_nothing_even_for_the_local_operator(service):
    client = service.client()
    for headers in (
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ):
        assert client.post("/rigs/rx130l-joint3-simulated/take", headers=headers).status_code == 403
    ours = {"Origin": "http://localhost:8000", "Sec-Fetch-Site": "same-origin"}
    assert client.post("/rigs/rx130l-joint3-simulated/take", headers=ours).status_code == 200


def test_a_page_of_another_site_cannot_look_on_over_a_websocket(service):
    from starlette.websockets import WebSocketDisconnect

    address = "ws://localhost:8000/rigs/rx130l-joint3-simulated/live"
    with (
        pytest.raises(WebSocketDisconnect) as refused,
        service.client().websocket_connect(address, headers={"Origin": "http://evil.example"}),
    ):
        pass
    assert refused.value.code == 1008


def test_a_foreign_name_that_resolves_to_this_machine_is_refused(service, start_service):
    answer = service.client().get("/me", headers={"Host": "evil.example"})
    assert answer.status_code == 400
    assert "--allow-host evil.example" in answer.json()["detail"]
    for host in ("localhost:9", "127.0.0.1", "[::1]:8000"):
        assert service.client().get("/me", headers={"Host": host}).status_code == 200
    allowed = start_service(allowed_hosts=("lab.example",))
    assert allowed.client().get("/me", headers={"Host": "lab.example:8000"}).status_code == 200


def test_every_response_forbids_framing_sniffing_and_foreign_scripts(service):
    headers = service.client().get("/me").headers
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert "default-src 'self'" in headers["Content-Security-Policy"]


def test_head_is_get_without_its_body(ada):
    """As RFC 9110, 9.3.2, asks: the same status and fields, for whoever looks before a download."""
    browser = ada.browser("ada")
    for address in ("/experiments", "/", "/nowhere"):
        asked, seen = browser.get(address), browser.head(address)
        assert seen.status_code == asked.status_code
        assert seen.headers["Content-Type"] == asked.headers["Content-Type"]
        assert seen.content == b""
    assert ada.client().head("/experiments").status_code == 401
    assert browser.head("/rigs/rx130l-joint3-simulated/take").status_code == 405


# --- live views


def test_one_person_has_so_many_live_views_at_a_time_and_as_many_again_once_they_are_closed(monkeypatch):
    monkeypatch.setattr(guard, "WEBSOCKETS_OF_ONE_PERSON", 2)
    opened, refused = [], []

    async def serve(scope, receive, send):
        """Open another view while this one is open, up to three inside each other."""
        opened.append(scope["user"])
        if scope["deep"] < 3:
            await watch(scope["user"], scope["deep"] + 1)

    async def watch(name, deep):
        async def send(message):
            refused.append((name, message["reason"]))

        scope = {"type": "websocket", "user": name, "deep": deep}
        await watched._watched_by(SimpleNamespace(name=name), HTTPConnection(scope), None, send)

    watched = guard.Guard(serve)
    for _ in range(3):  # each time two are open at once, and the third is refused
        anyio.run(watch, "ada", 1)
    anyio.run(watch, "bob", 3)
    assert opened == ["ada", "ada"] * 3 + ["bob"]
    assert refused == [("ada", "ada has 2 live views open already; close one.")] * 3


# --- the audit log


@pytest.mark.parametrize(
    ("user", "role_needed", "status", "unheard"),
    [
        (None, Role.VIEWER, 401, True),
        (None, None, 401, False),  # tried to sign in, and failed: that is written
        (None, None, 200, False),
        (None, None, 429, True),
        (None, None, 503, True),
        ("ada", None, 429, False),
        ("ada", Role.VIEWER, 403, False),
    ],
)
def test_a_stranger_who_was_turned_away_unheard_does_not_fill_the_log(user, role_needed, status, unheard):
    route = SimpleNamespace(role=role_needed)
    assert guard._of_no_account({"user": user}, route, status) is unheard


def test_a_stranger_at_an_address_that_is_none_does_not_fill_the_log():
    assert guard._of_no_account({}, None, 404)
