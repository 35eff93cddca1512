"""Numbers of a fit are computed once and kept beside it; what cannot be read is computed again."""

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from api.pages.kept_numbers import FOLDER, KeptNumbers, Numbers


@dataclass(frozen=True)
class Seen:
    mean: Numbers
    count: Numbers
    ends: tuple[float, float]


SEEN = Seen(np.array([[1.0 / 3.0, np.nan], [1e9, -2.0]]), np.array([[3, 0], [2, 1]]), (-1.0, 1.5))


def never() -> Seen:
    raise AssertionError("computed again")


def test_what_was_computed_is_read_by_another_process(tmp_path: Path) -> None:
    first = KeptNumbers[Seen]("seen", Seen).of(tmp_path, ["j1"], lambda: SEEN)
    again = KeptNumbers[Seen]("seen", Seen).of(tmp_path, ["j1"], never)
    for kept in (first, again):
        np.testing.assert_allclose(kept.mean, SEEN.mean, rtol=1e-6)
        assert kept.count.tolist() == [[3, 0], [2, 1]]
        assert kept.count.dtype.kind == "i"
        assert kept.ends == SEEN.ends
    np.testing.assert_array_equal(first.mean, again.mean)


def test_other_samples_have_other_numbers(tmp_path: Path) -> None:
    kept = KeptNumbers[list[float]]("listed", list[float])
    assert kept.of(tmp_path, ["j1"], lambda: [1.0]) == [1.0]
    assert kept.of(tmp_path, ["j2"], list) == []
    # nothing is a result too
    assert KeptNumbers[list[float]]("listed", list[float]).of(tmp_path, ["j2"], lambda: [2.0]) == []


@pytest.mark.parametrize(
    "damage", [b"", b"\xff", b'{"of": 3}', b"[]", b'{"of": "%s", "numbers": {"mean": "x"}}']
)
def test_a_damaged_file_is_computed_again(tmp_path: Path, damage: bytes, caplog) -> None:
    KeptNumbers[Seen]("seen", Seen).of(tmp_path, ["j1"], lambda: SEEN)
    (file,) = (tmp_path / FOLDER).iterdir()
    whole = file.read_bytes()
    file.write_bytes(damage)
    with caplog.at_level(logging.ERROR):
        KeptNumbers[Seen]("seen", Seen).of(tmp_path, ["j1"], lambda: SEEN)
    assert file.read_bytes() == whole


def test_a_folder_that_cannot_be_written_is_done_without(tmp_path: Path) -> None:
    (tmp_path / FOLDER).write_text("no folder")
    assert KeptNumbers[Seen]("seen", Seen).of(tmp_path, ["j1"], lambda: SEEN).ends == SEEN.ends
