"""Which dictionary a name means: one that comes with the software, or a drive's own."""

import pytest

from drivers.object_dictionary import load_object_dictionary, own_dictionary, passed_over
from drivers.profile import GENERIC


def test_a_dictionary_of_the_same_name_where_the_command_is_run_is_none_of_the_drive_s(tmp_path, monkeypatch):
    (tmp_path / "generic-cia402.eds").write_text("[1000]\nDataType=7\n", encoding="ascii")
    monkeypatch.chdir(tmp_path)
    assert own_dictionary(GENERIC.object_dictionary, 5) is None
    assert 0x6064 in load_object_dictionary(GENERIC.object_dictionary, 5)
    assert passed_over(GENERIC.object_dictionary, 5) == ()


@pytest.mark.parametrize("content", ["", "no dictionary"])
def test_a_file_that_is_none_says_nothing_of_the_drive(tmp_path, content):
    (tmp_path / "mine.eds").write_text(content, encoding="ascii")
    assert own_dictionary(tmp_path / "mine.eds", 5) is None
    assert "the profile alone says what is driven" in passed_over(tmp_path / "mine.eds", 5)[0]
