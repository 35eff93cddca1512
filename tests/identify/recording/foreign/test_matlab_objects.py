"""The part of a MAT file that holds objects, laid out here byte by byte as mat-io and MatFileHandler describe it."""

from __future__ import annotations

import numpy as np
import pytest

from identify.recording.foreign.matlab_objects import REFERENCE, ObjectStore, as_fields, is_reference

NAMES = ("table", "timeseries", "data", "varnames", "Time", "IsTimeFirst")


def description(version: int, trailing: bytes = b"") -> np.ndarray:
    """Of three objects: none (number 0), a `table` with saved properties, a `timeseries` with normal ones."""
    names = "\0".join(NAMES).encode() + b"\0"
    names += b"\0" * (-len(names) % 8)
    classes = [0, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0]  # (namespace, name, 0, 0); the first is none
    # (name, kind, value): kind 1 is a cell, counted from the third; kind 2 is a truth value
    saved = [0, 0, 2, 3, 1, 0, 4, 1, 1, 0]
    normal = [0, 0, 3, 5, 1, 2, 6, 2, 1, 3, 1, 99, 0, 0]
    # (class, 0, 0, saved, normal, dependency)
    objects = [0] * 6 + [1, 0, 0, 1, 0, 1] + [2, 0, 0, 0, 1, 2]
    header = {2: 32, 3: 40, 4: 40}[version]
    begins = [header + len(names)]
    for part in (classes, saved, objects, normal):
        begins.append(begins[-1] + 4 * len(part))
    begins += [begins[-1]] * ((header - 8) // 4 - len(begins))
    words = [version, len(NAMES), *begins]
    numbers = [*classes, *saved, *objects, *normal]
    content = np.array(words, "<u4").tobytes() + names + np.array(numbers, "<u4").tobytes() + trailing
    return np.frombuffer(content, np.uint8)


CELLS = (["speed", "current"], np.arange(3.0))


def store(version: int = 4, trailing: bytes = b"") -> ObjectStore:
    return ObjectStore([description(version, trailing), None, CELLS[1], CELLS[0], np.array([0.0, 0.1])])


def reference(*identities: int) -> np.ndarray:
    return np.array([REFERENCE, 2, len(identities), 1, *identities, 1], np.uint32)


@pytest.mark.parametrize("version", [2, 3, 4])
@pytest.mark.parametrize("trailing", [b"", b"\0\0\0"])
def test_every_layout_gives_the_objects_with_their_properties(version, trailing):
    objects = store(version, trailing)
    assert objects.names == list(NAMES)
    (table, of_table), (series, of_series) = objects.objects_of(reference(1, 2))
    assert (table, series) == ("table", "timeseries")
    assert of_table["data"] is CELLS[1]
    assert of_table["varnames"] is CELLS[0]
    assert of_series["Time"].tolist() == [0.0, 0.1]
    assert float(of_series["IsTimeFirst"]) == 1.0
    assert "data" not in of_series, "its cell is not in the file"


@pytest.mark.parametrize(
    "value",
    [
        {"a": 1},
        np.array([REFERENCE, 2, 1, 1, 1], np.uint32),  # too short
        np.array([REFERENCE + 1, 2, 1, 1, 1, 1], np.uint32),
        np.zeros(6),
    ],
    ids=["structure", "short", "other mark", "numbers"],
)
def test_what_refers_to_no_object_gives_none(value):
    assert store().objects_of(value) == []
    assert not is_reference(value)


def test_a_reference_inside_an_object_is_told_from_numbers():
    assert is_reference(reference(2))
    assert not is_reference(reference(2).astype(np.float64))
    assert not is_reference([REFERENCE, 2, 1, 1, 2, 1])


def test_the_fields_are_those_that_matlab_shows():
    data = [np.arange(2), np.ones(2)]
    assert as_fields("table", {"varnames": ["a", "b"], "data": data}) == {"a": data[0], "b": data[1]}
    assert as_fields("table", {"varnames": "a", "data": data}) is None
    inside = {"rowTimes": data[0], "varNames": ["x"], "data": data[1:]}
    assert as_fields("timetable", {"any": inside}) == {"Time": data[0], "x": data[1]}
    assert as_fields("timetable", inside) == {"Time": data[0], "x": data[1]}
    for time, values in (("Time_", "Data_"), ("Time", "Data")):
        series = as_fields("timeseries", {time: data[0], values: data[1]})
        assert series is not None
        assert series["Time"] is data[0]
        assert series["Data"] is data[1]
    assert as_fields("containers.Map", {}) is None


def test_objects_that_hold_each_other_are_not_handed_out_without_end():
    objects = store()
    for _ in range(50):
        objects.objects_of(reference(1, 2))
    with pytest.raises(ValueError, match="again and again"):
        objects.objects_of(reference(*[1] * 100))
