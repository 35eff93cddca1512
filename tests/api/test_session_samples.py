"""Samples of a session that is looked at: read once in a process of its own, and mapped from the files that it leaves."""

from __future__ import annotations

import os

import numpy as np
import pytest

from api.service import session_samples
from api.service.problems import Problem
from api.service.process_limits import LimitExceeded
from api.service.session_samples import READ, SessionSamples, read_session
from identify.recording import load_experiment
from tests.plants.single_joint import record, write_experiment


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One session of 4 s with the further columns `load [N]` and `note`, and one that is excluded."""
    made = record({}, seed=3, duration=4.0, rate=100.0, repeats=1, payload_masses=(0.0,))
    folder = write_experiment(tmp_path_factory.mktemp("samples") / "joint", made)
    table = (folder / "session-00.csv").read_text().splitlines()
    further = [f"{line},{3 * place},{place}.5" for place, line in enumerate(table[1:])]
    (folder / "session-00.csv").write_text("\n".join([f"{table[0]},force,../odd name", *further]) + "\n")
    return folder


class Reader:
    """Reads in this process, and counts how often."""

    def __init__(self, error=None):
        self.asked = []
        self.error = error

    def __call__(self, function, **arguments):
        self.asked.append(arguments["file"])
        assert function == READ
        if self.error:
            raise self.error
        return read_session(lambda done, step: None, **arguments)


def same(one, other):
    for name in ("time", "position", "command"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert list(one.extra) == list(other.extra)
    for name, values in other.extra.items():
        np.testing.assert_array_equal(one.extra[name], values)


def test_a_session_is_what_its_file_holds_with_its_further_columns_whatever_they_are_called(folder, tmp_path):
    loaded = load_experiment(folder)
    plain = loaded.read(loaded.sessions[0])
    shown = SessionSamples(tmp_path / "samples", Reader()).read(folder, "session-00.csv")
    assert {"force", "../odd name"} <= set(shown.extra)
    same(shown, plain)
    assert isinstance(shown.position, np.memmap)
    assert list((tmp_path / "samples").iterdir()) == []  # the files have no names any more


def test_it_is_read_once_until_the_file_or_the_experiment_changes(folder, tmp_path):
    reader = Reader()
    samples = SessionSamples(tmp_path, reader)
    first = samples.read(folder, "session-00.csv")
    assert samples.read(folder, "session-00.csv") is first
    assert len(reader.asked) == 1
    for count, changed in ((2, "session-00.csv"), (3, "experiment.yaml")):
        now = (folder / changed).stat().st_mtime_ns
        os.utime(folder / changed, ns=(now, now + 10**9))
        samples.read(folder, "session-00.csv")
        assert len(reader.asked) == count


def test_only_so_many_further_columns_are_kept(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(session_samples, "MOST_FURTHER", 1)
    shown = SessionSamples(tmp_path, Reader()).read(folder, "session-00.csv")
    assert len(shown.extra) == 1


def test_what_takes_more_than_there_is_cannot_be_shown(folder, tmp_path):
    reader = Reader(LimitExceeded("it needs more than 1 GB of memory"))
    with pytest.raises(Problem, match="cannot be shown here: it needs more than 1 GB of memory") as refused:
        SessionSamples(tmp_path, reader).read(folder, "session-00.csv")
    assert refused.value.status == 413
