"""What the torque plot is sent of a range."""

import struct

import httpx
import numpy as np

BASE = "/pages/experiments/rx130l-joint3"
QUERY = {"joint": "j3", "version": "m1"}


def test_the_torque_plot_marks_the_chosen_samples(browser_client: httpx.Client, models: dict) -> None:
    query = QUERY | {"session": "session-01.csv", "chosen": "time:10:12", "points": 4000}
    query |= {"start": 9.0, "stop": 13.0}
    answer = browser_client.get(f"{BASE}/samples", params=query)
    assert answer.headers["X-Curves"] == "measured,predicted,error,chosen"
    start, rows, points = struct.unpack_from("<dII", answer.content)
    table = np.frombuffer(answer.content, "<f4", offset=16).reshape(rows, points)
    time = start + table[0]
    np.testing.assert_array_equal(table[4] == 1, (time > 10 - 1e-4) & (time < 12 + 1e-4))
