"""The token against foreign requests: masked on pages, and taken as it is or masked."""

from hypothesis import given
from hypothesis import strategies as st

from api.service.access import is_token, masked

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
