"""The toggle bit of an answer to node guarding, and the life time that a node is given."""

import pytest

from drivers.node_guarding import ToggleBit, life_time_factor


def test_a_repeated_answer_is_none_and_a_boot_up_begins_anew():
    toggle = ToggleBit()
    answers = [0x7F, 0xFF, 0xFF, 0x7F, 0x00, 0x7F, 0x7F]
    assert [toggle.accepts(each) for each in answers] == [True, True, False, True, True, True, False]
    assert toggle.repeated == 2


@pytest.mark.parametrize(
    ("period", "timeout", "factor"), [(0.1, 0.5, 5), (0.1, 0.51, 6), (0.1, 0.05, 2), (0.001, 9, 255)]
)
def test_the_life_time_is_as_long_as_asked_for_at_least(period, timeout, factor):
    assert life_time_factor(period, timeout) == factor
