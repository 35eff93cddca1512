"""Model and measurement, and the samples behind its torque plot."""

import re
import struct
import time

import httpx
import numpy as np

MODEL = "/pages/experiments/rx130l-joint3/model"
SAMPLES = "/pages/experiments/rx130l-joint3/samples"


def decoded(content: bytes) -> tuple[float, np.ndarray]:
    start, rows, points = struct.unpack_from("<dII", content)
    return start, np.frombuffer(content, "<f4", offset=16).reshape(rows, points)


def test_the_page_states_the_error_of_the_stored_fit(browser_client: httpx.Client, models: dict) -> None:
    error = models["with load"].relative_error
    text = browser_client.get(MODEL).text
    assert f"{100 * error:.2f}" in text


def test_two_models_stand_beside_each_other_in_every_table(browser_client: httpx.Client) -> None:
    text = browser_client.get(MODEL, params={"version": "1", "beside": "2"}).text
    assert text.count(">model 1</th>") == text.count(">model 2</th>") >= 4


def test_nothing_on_the_page_comes_from_another_host(browser_client: httpx.Client) -> None:
    response = browser_client.get(MODEL)
    assert "default-src 'none'" in response.headers["content-security-policy"]
    assert "unsafe" not in response.headers["content-security-policy"]
    assert "<script>" not in response.text
    assert "style=" not in response.text
    outside = response.text.replace("http://www.w3.org/2000/svg", "")
    assert "http://" not in outside
    assert "https://" not in outside


def test_a_zoom_gives_the_samples_themselves_once_they_fit(
    browser_client: httpx.Client, models: dict
) -> None:
    query = {
        "joint": "j3",
        "version": "m1",
        "session": "session-01.csv",
        "points": 4000,
        "start": 10.0,
        "stop": 12.0,
    }
    start, rows = decoded(browser_client.get(SAMPLES, params=query).content)
    prediction = models["usual"].prediction("session-01.csv", "j3")
    inside = (prediction.time >= 10.0) & (prediction.time <= 12.0)
    found = (rows[0] + start >= 10.0 - 1e-6) & (rows[0] + start <= 12.0 + 1e-6)
    np.testing.assert_allclose(rows[1][found], prediction.measured[inside], rtol=1e-6)
    np.testing.assert_allclose(
        rows[3][found], (prediction.measured - prediction.predicted)[inside], atol=1e-4
    )


def test_the_whole_view_keeps_the_greatest_and_least_torque(
    browser_client: httpx.Client, models: dict
) -> None:
    query = {"joint": "j3", "version": "m1", "points": 600}
    _, rows = decoded(browser_client.get(SAMPLES, params=query).content)
    measured = models["usual"].measured
    assert np.nanmax(rows[1]) == np.float32(measured.max())
    assert np.nanmin(rows[1]) == np.float32(measured.min())
    assert rows.shape[1] <= 600


def test_sessions_end_to_end_are_not_joined_by_a_line(browser_client: httpx.Client) -> None:
    query = {"joint": "j3", "version": "m1", "points": 1200}
    _, rows = decoded(browser_client.get(SAMPLES, params=query).content)
    between = (rows[0] > 60.5) & (rows[0] < 61.5)
    assert between.any()
    assert np.isnan(rows[1][between]).all()


def test_an_unknown_joint_or_session_is_answered_in_words(browser_client: httpx.Client) -> None:
    response = browser_client.get(MODEL, params={"joint": "j9"})
    assert response.status_code == 404
    assert "no joint j9; it has j3" in response.text
    response = browser_client.get(MODEL, params={"session": "session-09.csv"})
    assert response.status_code == 404
    assert "session-09.csv" in response.text


def test_figures_are_drawn_once_for_a_fit(browser_client: httpx.Client) -> None:
    browser_client.get(MODEL)
    begun = time.perf_counter()
    for _ in range(3):
        assert browser_client.get(MODEL).status_code == 200
    assert time.perf_counter() - begun < 3.0


def test_scripts_and_styles_travel_compressed_to_whoever_takes_it(browser_client: httpx.Client) -> None:
    link = re.search(r'src="(/pages/static/[^"]+/torque_plot\.js)"', browser_client.get(MODEL).text)
    assert link is not None
    plain = browser_client.get(link[1], headers={"Accept-Encoding": "identity"})
    packed = browser_client.get(link[1], headers={"Accept-Encoding": "gzip"})
    assert packed.headers["content-type"] == plain.headers["content-type"]
    assert "javascript" in packed.headers["content-type"]
    assert packed.content == plain.content
    assert int(packed.headers["content-length"]) < 0.5 * int(plain.headers["content-length"])
