"""Columns of the samples by name: those of the fit, and those of the record."""

import json
import struct

import httpx
import numpy as np
import pytest

BASE = "/pages/experiments/rx130l-joint3"
QUERY = {"joint": "j3", "version": "m1"}


def test_the_extremes_of_two_columns_are_among_what_is_drawn(
    browser_client: httpx.Client, models: dict
) -> None:
    answer = browser_client.get(f"{BASE}/pairs", params=QUERY | {"x": "position", "y": "error", "across": 20})
    rows, points = struct.unpack_from("<II", answer.content)
    x, y = np.frombuffer(answer.content, "<f4", offset=8).reshape(rows, points)[:2]
    model = models["usual"]
    for drawn, given_ in ((x, model.motion["position"]), (y, model.measured - model.fitted)):
        assert drawn.min() == pytest.approx(given_.min(), rel=1e-5)
        assert drawn.max() == pytest.approx(given_.max(), rel=1e-5)
    assert points < 3000


def test_a_column_that_only_the_record_has_is_read_from_it(
    browser_client: httpx.Client, models: dict
) -> None:
    names = [each["name"] for each in browser_client.get(f"{BASE}/columns", params=QUERY).json()]
    assert names == ["command"]
    answer = browser_client.get(f"{BASE}/pairs", params=QUERY | {"x": "measured", "y": "command"})
    rows, points = struct.unpack_from("<II", answer.content)
    measured, command = np.frombuffer(answer.content, "<f4", offset=8).reshape(rows, points)[:2]
    np.testing.assert_allclose(command * 35.15, measured, rtol=1e-4, atol=1e-2)
    refused = browser_client.get(f"{BASE}/pairs", params=QUERY | {"x": "column:pressure", "y": "error"})
    assert refused.status_code == 409
    refused = browser_client.get(f"{BASE}/pairs", params=QUERY | {"x": "wind", "y": "error"})
    assert refused.status_code == 422
    assert "`wind` is not one of time, position" in refused.text


def test_a_range_that_is_seen_is_thinned_by_itself(browser_client: httpx.Client, models: dict) -> None:
    query = QUERY | {"x": "velocity", "y": "error", "across": 40, "up": 40}
    ranges = {"x_from": -0.1, "x_to": 0.1, "y_from": -5.0, "y_to": 5.0}
    answer = browser_client.get(f"{BASE}/pairs", params=query | ranges)
    model = models["usual"]
    velocity, error = model.motion["velocity"], model.measured - model.fitted
    inside = (np.abs(velocity) <= 0.1) & (np.abs(error) <= 5.0)
    told = json.loads(answer.headers["X-Pairs"])
    assert told["samples"] == len(error)
    assert told["seen"] == pytest.approx(inside.sum(), abs=2)  # stored in single precision
    rows, points = np.frombuffer(answer.content, "<u4", 2)
    table = np.frombuffer(answer.content, "<f4", offset=8).reshape(rows, points)
    assert np.abs(table[0]).max() <= 0.1 + 1e-6
    assert table[1].max() == pytest.approx(error[inside].max(), rel=1e-4)
    everything = browser_client.get(f"{BASE}/pairs", params=query)
    coarse = np.frombuffer(everything.content, "<f4", offset=8).reshape(6, -1)
    assert points > np.sum((np.abs(coarse[0]) <= 0.1) & (np.abs(coarse[1]) <= 5.0))
