"""A choice of samples: what stands in the address is what is chosen, counted and drawn."""

import pytest

from api.pages.sample_columns import Column
from api.pages.sample_selection import ColumnRange, SampleSelection
from api.service.problems import Problem


def test_a_choice_is_read_from_the_address_whatever_its_names_hold() -> None:
    found = SampleSelection.parse("column%3Aoil%3B%20bar:-0.5:2e-3;load:150:150;session:a%3Bb%3A%C3%A4.csv")
    ranges = (ColumnRange("column:oil; bar", -0.5, 0.002), ColumnRange("load", 150.0, 150.0))
    assert found == SampleSelection("a;b:ä.csv", ranges)
    assert SampleSelection.parse("") is None


@pytest.mark.parametrize(
    "text", ["velocity:1", "velocity:1:nan", "velocity:2:1", "velocity:a:b", ";".join(["load:0:1"] * 7)]
)
def test_what_is_no_choice_is_refused_in_words(text: str) -> None:
    with pytest.raises(Problem, match="chosen: "):
        SampleSelection.parse(text)


def test_words_have_the_digits_that_tell_both_ends_apart() -> None:
    chosen = SampleSelection("a.csv", (ColumnRange("time", 1234.5, 1236.0),))
    said = chosen.words(lambda name: Column(name, name, "s"))
    assert said.replace("\u2009", "") == "time 1234.50 to 1236.00 s, in a.csv"
