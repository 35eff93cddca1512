"""Two sessions over each other."""

import struct

import httpx
import numpy as np
import pytest

BASE = "/pages/experiments/rx130l-joint3"
QUERY = {"joint": "j3", "version": "m1"}


def test_two_sessions_begin_together(browser_client: httpx.Client, models: dict) -> None:
    query = QUERY | {"session": "session-00.csv", "overlay": "session-02.csv", "points": 20000}
    answer = browser_client.get(f"{BASE}/samples", params=query | {"start": 0.0, "stop": 5.0})
    assert answer.headers["X-Curves"].split(",")[3] == "measured overlay"
    _, rows, points = struct.unpack_from("<dII", answer.content)
    table = np.frombuffer(answer.content, "<f4", offset=16).reshape(rows, points)
    second = models["usual"].prediction("session-02.csv", "j3")
    np.testing.assert_allclose(
        table[4], np.interp(table[0], second.time, second.measured), rtol=1e-4, atol=0.5
    )
    coarse = browser_client.get(f"{BASE}/samples", params=query | {"points": 400})
    _, rows, points = struct.unpack_from("<dII", coarse.content)
    table = np.frombuffer(coarse.content, "<f4", offset=16).reshape(rows, points)
    assert np.nanmax(table[4]) == pytest.approx(second.measured.max(), rel=1e-5)
    assert points <= 400
