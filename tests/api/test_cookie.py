"""The sign-in's cookie, read where no middleware does."""

import json
import time
from base64 import b64encode

import pytest
from hypothesis import given
from hypothesis import strategies as st
from itsdangerous import TimestampSigner

from api.service.cookie import cookie_key, signed_content

KEY = "a key"


def cookie(content: object, key: str = KEY) -> str:
    """As Starlette's SessionMiddleware writes it."""
    return "coulomb=" + TimestampSigner(key).sign(b64encode(json.dumps(content).encode())).decode()


def test_what_was_signed_is_read_between_other_cookies():
    header = f"theme=dark; {cookie({'sign_in': 'x', 'csrf': 'y'})}; other=a=b"
    assert signed_content(header, KEY) == {"sign_in": "x", "csrf": "y"}


@pytest.mark.parametrize(
    "header",
    ["", "coulomb", "coulomb=", "coulomb=a.b.c", cookie({"a": 1}, "another"), cookie([1]), cookie(3)],
)
def test_anything_else_holds_nothing(header):
    assert signed_content(header, KEY) == {}


@given(st.text(max_size=200))
def test_no_header_is_too_odd(header):
    assert signed_content(header, KEY) == {}
    assert signed_content("coulomb=" + header, KEY) == {}


def test_a_header_full_of_quotes_takes_no_time():
    begun = time.perf_counter()
    signed_content('a="' + "\\" * 16_000 + '"', KEY)
    assert time.perf_counter() - begun < 0.1


def test_the_key_is_made_once_for_its_own_user_alone(tmp_path):
    key = cookie_key(tmp_path)
    assert cookie_key(tmp_path) == key
    assert (tmp_path / "cookie.key").stat().st_mode & 0o777 == 0o600
