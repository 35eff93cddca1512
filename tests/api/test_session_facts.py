"""What the list of sessions shows of a file without reading its samples."""

import json

import h5py
import numpy as np

from api.service.session_facts import read_facts


def facts_of(file):
    return read_facts(lambda _fraction, _words: None, [str(file)])[0]


def test_the_length_of_a_table_and_the_facts_of_a_recording_are_read_from_the_file(tmp_path):
    table = tmp_path / "a.csv"
    table.write_text("q1, t ,v1\n1,2.5,3\n1,3.0,3\n1,62.5,3\n\n")
    assert facts_of(table).seconds == 60.0
    table.write_text("q1,v1\n1,3\n")
    assert facts_of(table).seconds is None
    recording = tmp_path / "b.h5"
    with h5py.File(recording, "w") as file:
        file.attrs["started"], file.attrs["operator"] = "2026-11-22T15:04:05.000+00:00", "ada"
        file.attrs["rig"], file.attrs["plan"] = json.dumps({"name": "bench"}), json.dumps({"name": "slow"})
        file["sync_time"] = np.arange(1001) * 10**7
        valid = np.full((1001, 2), 3, np.uint8)
        valid[7, 1] = 1  # no command of one drive in one cycle
        file["valid"] = valid
    facts = facts_of(recording)
    assert (facts.started, facts.operator) == ("2026-11-22T15:04:05.000+00:00", "ada")
    assert (facts.rig, facts.plan, facts.seconds) == ("bench", "slow", 10.0)
    assert facts.lost == 1 / 2002
