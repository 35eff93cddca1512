"""What is said of a choice of samples, and what pictures draw of it."""

import httpx
import numpy as np
import pytest

BASE = "/pages/experiments/rx130l-joint3"
QUERY = {"joint": "j3", "version": "m1"}


def test_the_chosen_samples_are_counted_with_their_error(browser_client: httpx.Client, models: dict) -> None:
    model = models["usual"]
    motion, error = model.motion, model.measured - model.fitted
    inside = (np.abs(motion["velocity"] - 0.2) <= 0.1) & (motion["session"] == 1)
    answer = browser_client.get(
        f"{BASE}/chosen", params=QUERY | {"chosen": "velocity:0.1:0.3;session:session-01.csv"}
    ).json()
    assert answer["samples"] == inside.sum()
    rms = np.sqrt(np.mean(error[inside] ** 2))
    assert f"{rms:.3g} N m RMS" in answer["figures"]
    assert sum(answer["histogram"]) == pytest.approx(100 * inside.sum() / len(error), rel=0.02)
    assert max(answer["points"]["load"]) == pytest.approx(motion["load"][inside].max(), rel=1e-4)
    # what pictures without a place for single samples show of them
    chosen, measured = error[inside], model.measured[inside]
    relative = np.linalg.norm(chosen) / np.linalg.norm(measured)
    assert list(answer["payloads"]) == ["disk 3.5 kg"]
    assert answer["payloads"]["disk 3.5 kg"]["error"] == pytest.approx(relative)
    correlation = answer["correlation"]
    assert correlation["lag"][1] == pytest.approx(0.01)
    pairs = inside[:-1] & inside[1:]
    rest = error - error.mean()
    direct = np.mean((rest[:-1] * rest[1:])[pairs]) / np.mean(rest[inside] ** 2)
    assert correlation["correlation"][1] == pytest.approx(direct, rel=1e-3)


def test_where_nothing_is_chosen_no_picture_has_anything_to_show(browser_client: httpx.Client) -> None:
    answer = browser_client.get(f"{BASE}/chosen", params=QUERY | {"chosen": "velocity:90:91"}).json()
    assert answer["samples"] == 0
    assert answer["payloads"] == {}
    assert not any(answer["correlation"]["correlation"])
