"""The token against foreign requests: masked on pages, which are compressed, and taken as it is or masked."""

import gzip
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from api.service.access import is_token, masked
from api.service.accounts import Role
from tests.api.conftest import PASSWORD, RunningService

TOKEN = "kJ4v_0-Zq8m2h7X1bN5tR9wE3yU6iO0pAaSdFgHjKlQ"


def test_a_masked_token_is_the_token_and_never_twice_the_same():
    first, second = masked(TOKEN), masked(TOKEN)
    assert first != second
    assert is_token(first, TOKEN)
    assert is_token(second, TOKEN)
    assert is_token(TOKEN, TOKEN)
    half = len(first) // 2
    assert TOKEN.encode().hex() not in (first[:half], first[half:])


@given(st.one_of(st.text(), st.binary(max_size=100).map(bytes.hex)))
def test_nothing_else_is_the_token(sent: str):
    assert not is_token(sent, TOKEN)


def test_no_header_is_no_token():
    assert not is_token(None, TOKEN)
    assert not is_token(masked("other"), TOKEN)
    assert not is_token(masked(TOKEN[:-1] + "q"), TOKEN)


@pytest.mark.parametrize("accepted", ["gzip, br", "identity"])
def test_a_large_page_is_compressed_where_the_browser_takes_that_and_its_token_is_taken(
    service: RunningService, accepted: str
):
    service.service.accounts.add_user("grace", PASSWORD, Role.OPERATOR)
    browser = service.browser("grace")
    with browser.stream("GET", "/docs", headers={"Accept-Encoding": accepted}) as answer:
        sent = b"".join(answer.iter_raw())
        compressed = answer.headers.get("content-encoding") == "gzip"
        assert "Accept-Encoding" in answer.headers["vary"]
    assert compressed == ("gzip" in accepted)
    text = (gzip.decompress(sent) if compressed else sent).decode()
    assert not compressed or len(sent) < len(text.encode()) / 3
    found = re.search(r'name="csrf-token" content="([^"]+)"', text)
    assert found
    sign_out = "/sign-out"
    other = masked("another token, of the same forty-three letters")
    assert browser.post(sign_out, headers={"X-CSRF-Token": other}).status_code == 403
    assert browser.post(sign_out, headers={"X-CSRF-Token": found[1]}).status_code == 204
