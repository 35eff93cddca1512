"""A large page is compressed where the browser takes that; the token in it is masked, and taken back."""

import gzip
import re

import pytest

from api.service.access import masked
from api.service.accounts import Role
from tests.api.conftest import PASSWORD, RunningService


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
