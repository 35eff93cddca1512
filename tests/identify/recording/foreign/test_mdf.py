"""Measurement data files, written by asammdf: groups of channels with times of their own."""

import logging
import random
from datetime import UTC, datetime

import numpy as np
import pytest

from identify.recording import InputError
from identify.recording.foreign import ColumnMap, mdf, measure, read_foreign

asammdf = pytest.importorskip("asammdf", reason="the extra 'mdf' is not installed")

TIME = np.arange(800) / 400
ANGLE = 30 * np.sin(2 * TIME)
CURRENT = 1500 * np.cos(3 * TIME)
START = datetime(2026, 11, 27, 12, 0, tzinfo=UTC)


def signal(values, time, name, unit="", **more):
    return asammdf.Signal(np.asarray(values), time, name=name, unit=unit, **more)


def stored(path, groups, version="4.10"):
    with asammdf.MDF(version=version) as file:
        for group in groups:
            file.append(group)
        file.start_time = START
        return file.save(path, overwrite=True)


COLUMNS = ColumnMap(("pos",), ("cur",), "time")


@pytest.mark.parametrize("version", ["3.30", "4.00", "4.10", "4.20"])
def test_channels_of_one_group_in_every_version_with_units_and_the_hour(tmp_path, version):
    group = [
        signal(ANGLE, TIME, "pos", "deg"),
        signal(CURRENT, TIME, "cur", "mA"),
        signal(np.arange(800), TIME, "n"),
    ]
    table = read_foreign(stored(tmp_path / "log.mf4", [group], version))
    assert table.time == "time"
    session = measure(table, COLUMNS, [False])
    np.testing.assert_allclose(session.time - session.time[0], TIME, atol=1e-8)
    np.testing.assert_allclose(session.position[:, 0], np.deg2rad(ANGLE), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(session.command[:, 0], CURRENT / 1000, rtol=1e-9, atol=1e-12)
    assert any("2026-11-27T12:00:00.000Z" in words for words in session.remarks)
    assert any("pos: deg -> rad" in words and "the channel" in words for words in session.remarks)


def test_groups_of_one_time_stand_side_by_side_and_equal_names_are_told_apart(tmp_path):
    groups = [
        [signal(ANGLE, TIME, "pos", "deg"), signal(ANGLE, TIME, "status")],
        [signal(CURRENT, TIME, "cur", "mA"), signal(CURRENT, TIME, "status")],
    ]
    table = read_foreign(stored(tmp_path / "log.mf4", groups))
    assert table.names() == "time, pos, group1:status, cur, group2:status"
    np.testing.assert_allclose(measure(table, COLUMNS, [False]).command[:, 0], CURRENT / 1000, rtol=1e-15)


def test_groups_of_several_rates_are_joined_on_the_fastest(tmp_path):
    slow = np.arange(210) / 100 - 0.0513
    groups = [
        [signal(30 * np.sin(2 * slow), slow + 0.1, "pos", "deg")],
        [signal(CURRENT, TIME + 0.1, "cur", "mA")],
    ]
    session = measure(
        read_foreign(stored(tmp_path / "log.mf4", groups)),
        ColumnMap(("pos",), ("cur",), "joined time"),
        [False],
    )
    assert len(session.time) == 800
    since = session.time - session.time[0]
    np.testing.assert_allclose(session.position[:, 0], np.deg2rad(30 * np.sin(2 * since)), atol=2e-7)
    np.testing.assert_allclose(session.command[:, 0], 1.5 * np.cos(3 * since), atol=1e-9)
    assert any("joined on time: 800 samples of group2" in words for words in session.remarks)


def test_invalid_samples_words_and_structures(tmp_path):
    invalid = np.zeros(800, dtype=bool)
    invalid[5] = True
    group = [
        signal(ANGLE, TIME, "pos", "deg", invalidation_bits=invalid),
        signal(CURRENT, TIME, "cur", "mA"),
        signal(np.array([b"on"] * 800), TIME, "mode", encoding="utf-8"),
    ]
    table = read_foreign(stored(tmp_path / "log.mf4", [group]))
    assert list(table.column("mode", "test").words[:2]) == ["on", "on"]
    with pytest.raises(InputError, match="column 'pos', sample 6: not a finite number"):
        measure(table, COLUMNS, [False])
    assert len(measure(table, COLUMNS, [False], "drop").time) == 799


def test_a_file_without_channels_is_refused_and_points_to_a_log_where_it_holds_something_else(
    tmp_path, monkeypatch
):
    path = stored(tmp_path / "log.mf4", [])
    with pytest.raises(InputError, match=r"log\.mf4: holds no channels of numbers$"):
        read_foreign(path)
    monkeypatch.setattr(mdf, "_tables", lambda path, file: ([], ["frames is no single number"]))
    said = r"numbers \(frames is no single number\); of frames on a CAN bus give a log, with --rig$"
    with pytest.raises(InputError, match=said):
        read_foreign(path)


def test_damaged_files_are_read_or_refused_in_one_line(tmp_path):
    path = stored(
        tmp_path / "log.mf4", [[signal(ANGLE, TIME, "pos", "deg"), signal(CURRENT, TIME, "cur", "mA")]]
    )
    whole = path.read_bytes()
    choose = random.Random(14)
    for _case in range(12):
        content = bytearray(whole)
        if choose.random() < 0.4:
            content = content[: choose.randrange(8, len(content))]
        for _byte in range(choose.choice([1, 8, 64])):
            content[choose.randrange(8, len(content))] = choose.randrange(256)
        path.write_bytes(content)
        try:
            read_foreign(path)
        except InputError as error:
            assert "log.mf4" in str(error)  # noqa: PT017
            assert "\n" not in str(error)  # noqa: PT017
    assert logging.getLogger("asammdf").level == logging.CRITICAL


def test_without_asammdf_the_extra_is_named(tmp_path, monkeypatch):
    path = stored(tmp_path / "log.mf4", [[signal(ANGLE, TIME, "pos", "deg")]])
    monkeypatch.setitem(__import__("sys").modules, "asammdf", None)
    with pytest.raises(InputError, match=r"pip install 'coulomb\[mdf\]'"):
        read_foreign(path)
