"""Remarks and reasons become sentences."""

import pytest

from api.pages.sentence import sentence


@pytest.mark.parametrize(
    ("text", "said"),
    [("a gap is no spring", "A gap is no spring."), ("It ends.", "It ends."), ("", ""), ("x", "X.")],
)
def test_a_text_gets_a_capital_and_one_full_stop(text, said):
    assert sentence(text) == said
