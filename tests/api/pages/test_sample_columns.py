"""Columns of the samples by name: those of the fit, and those of the record."""

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
