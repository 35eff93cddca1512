"""Bodies that no client of ours would send: refused as the client's mistake by every route, and never an error of ours."""

import json

import pytest
from fastapi.routing import APIRoute, iter_route_contexts

from api.service.accounts import Role

DEEP = 50_000
BODIES = {
    "nothing": b"",
    "half": b'{"name": ',
    "null": b"null",
    "list": b"[]",
    "number": b"7",
    "infinite": b'{"mass": 1e999, "seconds": 1e999, "days": 1e999, "seed": 1e999}',
    "not a number": b'{"mass": NaN, "seconds": NaN, "days": -Infinity}',
    "long number": b'{"seed": ' + b"9" * 100_000 + b"}",
    "deep": b"[" * DEEP + b"]" * DEEP,
    "deep objects": b'{"a":' * DEEP + b"1" + b"}" * DEEP,
    "lone surrogate": b'{"name": "\\ud800", "rig": "\\udfff", "model": "\\ud800", "effect": "\\ud800", "label": "\\ud800"}',
    "nul": b'{"name": "a\\u0000b", "rig": "a\\u0000b", "label": "a\\u0000b", "joint": "a\\u0000b"}',
    "not UTF-8": b'{"name": "\xff\xfe"}',
    "many keys": json.dumps({f"key{number}": number for number in range(20_000)}).encode(),
    "long": json.dumps({"name": "a" * 900_000, "rig": "a" * 50_000}).encode(),
    "key twice": b'{"name": "a", "name": "b", "rig": "x", "rig": 3}',
    "wrong kinds": b'{"name": [], "rig": {}, "add": "x", "payload": 7, "role": null, "joint": 0, "password": [1]}',
}
IDS = {
    "experiment": "arm",
    "session": "session-00",
    "model": "m1",
    "job": "0" * 16,
    "rig": "rx130l-joint3-simulated",
    "plan": "x",
    "user": "eve",
    "token": "0" * 16,
    "name": "eve",
}


@pytest.fixture
def admin(service):
    client = service.client(Role.ADMIN)
    service.client(Role.VIEWER, "eve")
    rig = "rx130l-joint3-simulated"
    assert client.post("/experiments", json={"name": "arm", "rig": rig}).status_code == 201
    return client


def changing_routes(application):
    for route in iter_route_contexts(application.routes):
        if isinstance(route.original_route, APIRoute):
            for method in sorted(set(route.methods or ()) & {"POST", "PUT", "PATCH"}):
                yield method, route.path or ""


@pytest.mark.parametrize("name", list(BODIES))
def test_a_body_that_makes_no_sense_is_never_an_error_of_ours(admin, service, name):
    wrong = []
    for method, path in changing_routes(service.application):
        kind = "application/x-www-form-urlencoded" if path.startswith("/pages") else "application/json"
        if path.endswith("import"):
            kind = "multipart/form-data; boundary=x"
        address = path.format(**{key: IDS.get(key, "x") for key in _parameters(path)})
        answer = admin.request(method, address, content=BODIES[name], headers={"Content-Type": kind})
        if answer.status_code >= 500:
            wrong.append(f"{method} {path} {kind}: {answer.status_code} {answer.text[:200]}")
    assert not wrong, "\n".join(wrong)


def _parameters(path):
    return [part[1:-1].partition(":")[0] for part in path.split("/") if part.startswith("{")]
