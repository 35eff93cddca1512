"""Every call of the service by every role."""

from collections.abc import Iterator
from itertools import product

import pytest
from fastapi.routing import APIRoute, APIWebSocketRoute, iter_route_contexts
from starlette.websockets import WebSocketDisconnect

from api.service.access import declared_role
from api.service.accounts import Role

EVERYBODY = None
VIEWER, OPERATOR, ADMIN = Role.VIEWER, Role.OPERATOR, Role.ADMIN

# Who may make which call. A call of the service that is not in this table fails the first test.
TABLE: dict[tuple[str, str], Role | None] = {
    ("POST", "/sign-in"): EVERYBODY,
    ("POST", "/sign-out"): VIEWER,
    ("GET", "/me"): VIEWER,
    ("PUT", "/me/password"): VIEWER,
    ("GET", "/users"): ADMIN,
    ("POST", "/users"): ADMIN,
    ("PATCH", "/experiments/{experiment}/sessions/{session}"): OPERATOR,
    ("PATCH", "/users/{user}"): ADMIN,
    ("DELETE", "/users/{user}"): ADMIN,
    ("GET", "/tokens"): VIEWER,
    ("POST", "/tokens"): VIEWER,
    ("DELETE", "/tokens/{token}"): VIEWER,
    ("GET", "/audit"): ADMIN,
    ("GET", "/docs"): VIEWER,
    ("GET", "/experiments"): VIEWER,
    ("POST", "/experiments"): OPERATOR,
    ("POST", "/experiments/demo"): OPERATOR,
    ("POST", "/experiments/import"): OPERATOR,
    ("POST", "/experiments/import/can-logs"): OPERATOR,
    ("POST", "/experiments/import/columns"): OPERATOR,
    ("POST", "/experiments/import/records"): OPERATOR,
    ("GET", "/experiments/{experiment}"): VIEWER,
    ("GET", "/experiments/{experiment}/results"): VIEWER,
    ("GET", "/experiments/{experiment}/models"): VIEWER,
    ("POST", "/experiments/{experiment}/models"): OPERATOR,
    ("POST", "/experiments/{experiment}/models/refit"): OPERATOR,
    ("POST", "/experiments/{experiment}/models/effects"): OPERATOR,
    ("POST", "/experiments/{experiment}/models/effects/remove"): OPERATOR,
    ("POST", "/experiments/{experiment}/models/undo"): OPERATOR,
    ("POST", "/experiments/{experiment}/models/redo"): OPERATOR,
    ("GET", "/experiments/{experiment}/models/compare"): VIEWER,
    ("GET", "/experiments/{experiment}/models/{model}"): VIEWER,
    ("GET", "/experiments/{experiment}/models/{model}/signals"): VIEWER,
    ("POST", "/experiments/{experiment}/models/{model}/diagnosis"): OPERATOR,
    ("GET", "/experiments/{experiment}/models/{model}/diagnosis"): VIEWER,
    ("POST", "/experiments/{experiment}/models/{model}/simulation"): OPERATOR,
    ("GET", "/experiments/{experiment}/models/{model}/simulation"): VIEWER,
    ("GET", "/experiments/{experiment}/models/{model}/simulation/free-run"): VIEWER,
    ("POST", "/experiments/{experiment}/models/{model}/exports/{ending}"): OPERATOR,
    ("GET", "/experiments/{experiment}/models/{model}/exports/{ending}"): VIEWER,
    ("GET", "/experiments/{experiment}/models/{model}/exports/{ending}/file"): VIEWER,
    ("GET", "/experiments/{experiment}/proofs"): VIEWER,
    ("POST", "/experiments/{experiment}/drive-tables"): OPERATOR,
    ("GET", "/experiments/{experiment}/drive-tables"): VIEWER,
    ("POST", "/experiments/{experiment}/drive-tables/writings"): OPERATOR,
    ("GET", "/experiments/{experiment}/drive-tables/writings"): VIEWER,
    ("POST", "/experiments/{experiment}/drive-tables/writings/{writing}/back"): OPERATOR,
    ("POST", "/experiments/{experiment}/proofs"): OPERATOR,
    ("GET", "/experiments/{experiment}/proofs/{proof}"): VIEWER,
    ("POST", "/experiments/{experiment}/proofs/{proof}/drives/{drive}"): OPERATOR,
    ("POST", "/experiments/{experiment}/models/{model}/next-experiment"): OPERATOR,
    ("GET", "/experiments/{experiment}/models/{model}/next-experiment"): VIEWER,
    ("POST", "/experiments/{experiment}/models/{model}/next-experiment/plan"): OPERATOR,
    ("POST", "/experiments/{experiment}/improvement"): OPERATOR,
    ("GET", "/effects"): VIEWER,
    ("GET", "/experiments/{experiment}/recordings"): VIEWER,
    ("GET", "/experiments/{experiment}/recordings/{session}"): VIEWER,
    ("GET", "/experiments/{experiment}/recordings/{session}/signals"): VIEWER,
    ("GET", "/experiments/{experiment}/sessions"): VIEWER,
    ("POST", "/experiments/{experiment}/sessions"): OPERATOR,
    ("POST", "/experiments/{experiment}/sessions/import"): OPERATOR,
    ("GET", "/experiments/{experiment}/sessions/{session}"): VIEWER,
    ("DELETE", "/experiments/{experiment}/sessions/{session}"): OPERATOR,
    ("POST", "/experiments/{experiment}/sessions/{session}/check"): OPERATOR,
    ("POST", "/experiments/{experiment}/sessions/{session}/weigh"): OPERATOR,
    ("POST", "/experiments/{experiment}/sessions/{session}/confirm"): OPERATOR,
    ("POST", "/experiments/{experiment}/sessions/{session}/arm"): OPERATOR,
    ("POST", "/experiments/{experiment}/sessions/{session}/start"): OPERATOR,
    ("POST", "/experiments/{experiment}/sessions/{session}/stop"): VIEWER,
    ("POST", "/experiments/{experiment}/sessions/{session}/recover"): OPERATOR,
    ("POST", "/experiments/{experiment}/sessions/{session}/admit"): OPERATOR,
    ("GET", "/jobs"): VIEWER,
    ("GET", "/jobs/{job}"): VIEWER,
    ("POST", "/jobs/{job}/cancel"): OPERATOR,
    ("WEBSOCKET", "/jobs/{job}/live"): VIEWER,
    ("GET", "/rigs"): VIEWER,
    ("GET", "/rigs/{rig}"): VIEWER,
    ("POST", "/rigs/{rig}/take"): OPERATOR,
    ("POST", "/rigs/{rig}/release"): OPERATOR,
    ("POST", "/rigs/{rig}/hand-over"): OPERATOR,
    ("POST", "/rigs/{rig}/homing"): OPERATOR,
    ("GET", "/rigs/{rig}/homing"): VIEWER,
    ("POST", "/rigs/{rig}/reset"): OPERATOR,
    ("POST", "/rigs/{rig}/stop"): VIEWER,
    ("WEBSOCKET", "/rigs/{rig}/live"): VIEWER,
    ("GET", "/plans"): VIEWER,
    ("POST", "/plans"): OPERATOR,
    ("GET", "/plans/{plan}"): VIEWER,
    ("GET", "/plans/{plan}/preview"): VIEWER,
}
TABLE[("GET", "/openapi.json")] = VIEWER
BY_PERSONS = {("PUT", "/me/password"), ("POST", "/tokens"), ("DELETE", "/tokens/{token}")}
"""What is refused to whoever asks with a bearer token, as the clients here do."""
PATH_EXAMPLES = {
    "experiment": "unknown",
    "session": "session-99",
    "model": "m99",
    "ending": "urdf",
    "proof": "99",
    "writing": "99",
    "drive": "without",
    "job": "0" * 16,
    "rig": "unknown",
    "plan": "unknown",
    "user": "unknown",
    "token": "0" * 16,
}


def rest_routes(application) -> Iterator[tuple[str, str]]:
    """(method, path) of every call but those of the pages."""
    for route in iter_route_contexts(application.routes):
        if (route.path or "").startswith("/pages") or route.path == "/":
            continue
        if isinstance(route.original_route, APIWebSocketRoute):
            yield "WEBSOCKET", route.path or ""
        elif isinstance(route.original_route, APIRoute):
            for method in route.methods or ():
                yield method, route.path or ""


def test_every_call_is_in_the_table_and_nothing_else_is(service):
    assert set(rest_routes(service.application)) == set(TABLE)


def _call(client, method: str, path: str) -> int:
    address = path.format(**PATH_EXAMPLES)
    if method != "WEBSOCKET":
        return client.request(method, address).status_code
    try:
        with client.websocket_connect(f"ws://localhost:8000{address}"):
            return 101
    except WebSocketDisconnect as closed:
        return {1008: 401, 4404: 404}[closed.code]


@pytest.mark.parametrize("role", [None, *Role], ids=str)
def test_a_call_is_answered_for_who_may_make_it_and_refused_for_everybody_else(service, role):
    service.client(Role.ADMIN)  # from the first account on, everybody signs in
    client = service.client(role)
    wrong = []
    for (method, path), needed in TABLE.items():
        status = _call(client, method, path)
        if needed is not EVERYBODY and role is None:
            expected = status == 401
        elif needed is not EVERYBODY and not role.covers(needed):
            expected = status == 403
        elif (method, path) in BY_PERSONS:
            expected = status in (403, 415)  # the body's kind is looked at before
        else:
            expected = status not in (401, 403) and status < 500
        if not expected:
            wrong.append(f"{method} {path} as {role}: {status}")
    assert not wrong


@pytest.mark.parametrize(("role", "scope"), list(product(Role, Role)))
def test_a_token_never_reaches_beyond_its_owners_role(service, role, scope):
    service.service.accounts.add_user("owner", "correct horse battery", role)
    answer = service.browser("owner").post("/tokens", json={"label": "test", "scope": scope})
    if not role.covers(scope):
        assert answer.status_code == 403
        return
    client = service.client()
    client.headers["Authorization"] = f"Bearer {answer.json()['secret']}"
    assert client.get("/me").json()["role"] == scope


def test_a_token_loses_what_its_owner_loses(service):
    client = service.client(Role.OPERATOR, "grace")
    service.client(Role.ADMIN).patch("/users/grace", json={"role": "viewer"})
    assert client.get("/me").json()["role"] == "viewer"
    assert client.post("/plans").status_code == 403


def test_a_route_that_says_no_role_stops_the_start(service, data_folder, monkeypatch):
    from fastapi import APIRouter

    from api.application import create_application
    from api.service.routes import audit
    from api.service.settings import ServiceSettings

    careless = APIRouter()
    careless.add_api_route("/careless", lambda: None)
    monkeypatch.setattr(audit, "router", careless)
    with pytest.raises(RuntimeError, match="/careless does not say which role"):
        create_application(ServiceSettings(data_folder=data_folder))


PAGES_FOR_OTHERS = {
    "/pages/sign-in": EVERYBODY,
    "/pages/sign-out": VIEWER,
    "/pages/stop": VIEWER,
    "/pages/account/password": VIEWER,
    "/pages/account/tokens": VIEWER,
    "/pages/account/tokens/{token}/revoke": VIEWER,
    "/pages/users": ADMIN,
    "/pages/users/{name}/role": ADMIN,
    "/pages/users/{name}/remove": ADMIN,
}


def test_what_a_page_changes_is_an_operators_business_but_for_a_few(service):
    found = {
        route.path: declared_role(route)
        for route in iter_route_contexts(service.application.routes)
        if (route.path or "").startswith("/pages") and set(route.methods or ()) - {"GET", "HEAD"}
    }
    assert set(PAGES_FOR_OTHERS) <= set(found)
    wrong = {path: role for path, role in found.items() if role != PAGES_FOR_OTHERS.get(path, OPERATOR)}
    assert wrong == {}
