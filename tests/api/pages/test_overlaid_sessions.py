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


def test_two_sessions_of_two_models_are_drawn_together(browser_client: httpx.Client, models: dict) -> None:
    query = {"joint": "j3", "version": "m2", "beside": "m1", "session": "session-00.csv", "points": 20000}
    both = query | {"overlay": "session-02.csv", "start": 0.0, "stop": 5.0}
    answer = browser_client.get(f"{BASE}/samples", params=both)
    names = ["time", *answer.headers["X-Curves"].split(",")]
    _, rows, points = struct.unpack_from("<dII", answer.content)
    curves = dict(
        zip(names, np.frombuffer(answer.content, "<f4", offset=16).reshape(rows, points), strict=True)
    )
    for name, model in (("predicted overlay", "with load"), ("predicted overlay beside", "usual")):
        second = models[model].prediction("session-02.csv", "j3")
        expected = np.interp(curves["time"], second.time, second.predicted)
        np.testing.assert_allclose(curves[name], expected, rtol=1e-4, atol=0.5)
    first = models["usual"].prediction("session-00.csv", "j3")
    expected = np.interp(curves["time"], first.time, first.measured - first.predicted)
    np.testing.assert_allclose(curves["error beside"], expected, rtol=1e-3, atol=0.5)
    page = browser_client.get(f"{BASE}/model", params={"session": "session-00.csv", "beside": "1"}).text
    assert '<option value="session-02.csv">' in page
