"""Parquet files as pandas, pyarrow and loggers write them."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pyarrow
import pytest
from pyarrow import parquet

from identify.recording import InputError
from identify.recording.foreign import ColumnMap, measure, read_foreign

TIME = np.arange(300) / 250
ANGLE = 40 * np.sin(2 * TIME)
CURRENT = 1500 * np.cos(3 * TIME)
START = datetime(2026, 11, 27, 12, 0, tzinfo=UTC)


def stored(path, columns, metadata=None, **options):
    """Write columns (name -> array of Arrow), with units in the fields' metadata."""
    arrays = {name: pyarrow.array(values) for name, values in columns.items()}
    fields = [
        pyarrow.field(
            name, array.type, metadata={"unit": metadata[name]} if metadata and name in metadata else None
        )
        for name, array in arrays.items()
    ]
    parquet.write_table(pyarrow.table(list(arrays.values()), schema=pyarrow.schema(fields)), path, **options)
    return path


CLOCKS = {
    "s": TIME,
    "ms": TIME * 1000,
    "timestamp us": pyarrow.array(
        [START + timedelta(seconds=t) for t in TIME], pyarrow.timestamp("us", "UTC")
    ),
    "timestamp ns": pyarrow.array(
        (TIME * 1e9).round().astype("int64") + 1_764_244_800 * 10**9, pyarrow.timestamp("ns")
    ),
    "duration": pyarrow.array((TIME * 1e6).round().astype("int64"), pyarrow.duration("us")),
    "epoch ns": (TIME * 1e9).round().astype("int64") + 1_764_244_800 * 10**9,
    "float32": TIME.astype(np.float32),
}


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize(
    "options", [{}, {"row_group_size": 37, "compression": "gzip"}, {"use_dictionary": True}]
)
def test_columns_units_and_clocks_of_every_type_are_read(tmp_path, clock, options):
    path = stored(
        tmp_path / "log.parquet",
        {"stamp": CLOCKS[clock], "angle": ANGLE, "current": CURRENT.astype(np.float32), "note": ["ok"] * 300},
        {"angle": "deg", "current": "mA"},
        **options,
    )
    columns = ColumnMap(
        ("angle",), ("current",), "stamp", time_unit="ms" if clock == "ms" else None, extra=("note",)
    )
    session = measure(read_foreign(path), columns, [False])
    np.testing.assert_allclose(session.time - session.time[0], TIME, atol=1e-6)
    np.testing.assert_allclose(session.position[:, 0], np.deg2rad(ANGLE), rtol=1e-12)
    np.testing.assert_allclose(session.command[:, 0], CURRENT / 1000, rtol=1e-6)
    assert list(session.extra["note"]) == ["ok"] * 300
    assert any(words.startswith("angle: deg -> rad") and "metadata" in words for words in session.remarks)


def test_integers_booleans_decimals_and_missing_values(tmp_path):
    whole = pyarrow.array([None if k == 7 else k for k in range(300)], pyarrow.int32())
    path = stored(
        tmp_path / "log.parquet",
        {
            "t": TIME,
            "q [deg]": ANGLE,
            "i [mA]": pyarrow.array([round(float(x), 2) for x in CURRENT]).cast(pyarrow.decimal128(20, 10)),
            "whole": whole,
            "on": pyarrow.array([True, False] * 150),
            "ragged": pyarrow.array([[1.0, 2.0], [1.0]] * 150),
        },
    )
    table = read_foreign(path)
    assert np.isnan(table.column("whole", "test").numbers[7])
    assert table.column("on", "test").numbers.tolist() == [1.0, 0.0] * 150
    assert not table.has("ragged")
    assert table.remarks == ("columns of another type passed over: ragged (list<element: double>)",)
    session = measure(table, ColumnMap(("q",), ("i",), "t"), [False])
    np.testing.assert_allclose(session.command[:, 0], CURRENT / 1000, atol=1e-5)
    with pytest.raises(InputError, match=r"column 'whole', sample 8: not a finite number; --repair"):
        measure(table, ColumnMap(("q",), ("whole",), "t"), [False])


def test_joints_in_lists_structures_and_categories_have_columns_of_their_own(tmp_path):
    state = pyarrow.array([{"position": [q, 2 * q], "mode": "on"} for q in ANGLE.tolist()])
    path = stored(
        tmp_path / "log.parquet", {"t": TIME, "state": state, "effort": [[i, -i] for i in CURRENT.tolist()]}
    )
    table = read_foreign(path)
    assert table.names() == "t, state.position:1, state.position:2, state.mode, effort:1, effort:2"
    columns = ColumnMap(("state.position:1", "state.position:2"), ("effort:1", "effort:2"), "t")
    session = measure(table, columns, [False, False])
    np.testing.assert_array_equal(session.position, np.stack([ANGLE, 2 * ANGLE], axis=1))
    np.testing.assert_array_equal(session.command, np.stack([CURRENT, -CURRENT], axis=1))
    with pytest.raises(InputError, match=r"'effort' has 2 columns; say which .*effort:1"):
        measure(table, ColumnMap(("state.position:1",), ("effort",), "t"), [False])


def test_a_missing_stamp_is_named_and_can_be_left_out(tmp_path):
    stamps = [None if k in (0, 9) else START + timedelta(seconds=float(t)) for k, t in enumerate(TIME)]
    clock = pyarrow.array(stamps, pyarrow.timestamp("us"))
    table = read_foreign(stored(tmp_path / "log.parquet", {"t": clock, "q": ANGLE, "i": CURRENT}))
    columns = ColumnMap(("q",), ("i",), "t")
    with pytest.raises(InputError, match=r"column 't', sample 1: not a finite number"):
        measure(table, columns, [False])
    session = measure(table, columns, [False], "drop")
    np.testing.assert_allclose(np.diff(session.time[:7]), 0.004, atol=1e-6)
    assert len(session.time) == 298


def test_a_damaged_file_and_one_without_numbers_are_refused_in_one_line(tmp_path):
    path = stored(tmp_path / "log.parquet", {"t": TIME, "q": ANGLE})
    whole = path.read_bytes()
    for damaged in (whole[:200], whole[:-30], whole[:50] + bytes(len(whole) - 100) + whole[-50:]):
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"log\.parquet: cannot be read as Parquet") as refused:
            read_foreign(path)
        assert "\n" not in str(refused.value)
    stored(path, {"note": ["a", "b"]})
    with pytest.raises(InputError, match="holds no column of numbers"):
        read_foreign(path)
