"""How large a body may be: by its route, by what it says of itself, and by what then comes."""

import asyncio
from types import SimpleNamespace

import pytest
from starlette.exceptions import HTTPException
from starlette.requests import Request

from api.service.accounts import Role
from api.service.problems import Problem
from api.service.request_body import LARGEST_OF_STRANGERS, MOST_RECORDS, body_limit, bounded, check_length

SETTINGS = SimpleNamespace(body_limit=1000, upload_limit=50_000)


@pytest.mark.parametrize(
    ("role", "takes_file", "limit"),
    [
        (None, True, LARGEST_OF_STRANGERS),
        (Role.VIEWER, False, 1000),
        (Role.OPERATOR, True, 50_000),
    ],
)
def test_a_stranger_may_send_a_name_and_a_password_and_a_file_goes_where_one_is_taken(
    role, takes_file, limit
):
    assert body_limit(SimpleNamespace(role=role, takes_file=takes_file), SETTINGS) == limit


def test_what_is_no_route_takes_no_more_than_a_stranger_sends():
    assert body_limit(None, SETTINGS) == LARGEST_OF_STRANGERS


def said_to_have(length: bytes | None) -> Request:
    headers = [] if length is None else [(b"content-length", length)]
    return Request({"type": "http", "headers": headers})


@pytest.mark.parametrize("length", [None, b"0", b"10", b"ten", b"-11"])
def test_a_length_within_the_limit_or_none_at_all_is_let_in(length):
    check_length(said_to_have(length), 10)


def test_a_length_beyond_the_limit_is_refused_and_the_connection_closed():
    with pytest.raises(Problem) as refused:
        check_length(said_to_have(b"11"), 10)
    assert refused.value.status == 413
    assert refused.value.headers == {"Connection": "close"}


def test_a_body_is_counted_over_all_its_parts_while_it_comes():
    parts = [{"type": "http.request", "body": body} for body in (b"12345", b"67890", b"")]
    parts += [{"type": "http.disconnect"}, {"type": "http.request", "body": b"1"}]
    coming = iter(parts)

    async def receive():
        return next(coming)

    counted = bounded(receive, 10)
    for part in parts[:4]:
        assert asyncio.run(counted()) == part
    with pytest.raises(HTTPException) as refused:
        asyncio.run(counted())
    assert refused.value.status_code == 413


def test_one_session_may_come_in_as_many_files_as_a_form_reads(service):
    client = service.client(Role.OPERATOR)

    def answer(count: int) -> tuple[int, str]:
        files = [("files", (f"{number}.csv", b"t [s];q [rad]\n0;1\n1;2\n2;1\n")) for number in range(count)]
        answered = client.post("/experiments/import/columns", files=files)
        return answered.status_code, "" if answered.is_success else answered.json()["detail"]

    most = MOST_RECORDS
    assert answer(most) == (200, "")
    assert answer(most + 1) == (
        422,
        f"body.files: List should have at most {most} items after validation, not {most + 1}",
    )
    assert answer(most + 2) == (400, f"Too many files. Maximum number of files is {most + 1}.")
