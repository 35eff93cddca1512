"""Remarks and reasons become sentences."""

import pytest

from api.pages.sentence import sentence


@pytest.mark.parametrize(
    ("text", "said"),
    [("a gap is no spring", "A gap is no spring."), ("It ends.", "It ends."), ("", ""), ("x", "X.")],
)
def test_a_text_gets_a_capital_and_one_full_stop(text, said):
    assert sentence(text) == said


@pytest.mark.parametrize(
    "text", ["j3: 2 % of the plan asked for more", "b_m@j6, b_g@j6 are not told by the motion"]
)
def test_a_name_keeps_its_small_letter(text):
    assert sentence(text) == f"{text}."
