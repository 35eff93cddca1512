"""Rig, new session, live and the run bar, without anything moving."""

import re

import httpx
import pytest

PAGES = (
    "rig",
    "new-session",
    "live",
    "experiments",
    "experiments/rx130l-joint3/model",
    "experiments/rx130l-joint3/missing",
    "experiments/rx130l-joint3/results",
    "experiments/rx130l-joint3/drive-tables",
    "account",
)


@pytest.mark.parametrize("name", PAGES)
def test_every_page_has_the_stop_button_and_the_six_steps_in_order(
    browser_client: httpx.Client, name: str
) -> None:
    text = browser_client.get(f"/pages/{name}").text
    assert text.count("data-stop>") == 1
    steps = re.findall(r'<span class="ordinal">\d</span>([^<]+)</a>', text)
    assert steps == ["Rig", "New session", "Live", "Model and measurement", "What is missing", "Results"]


def test_the_rig_page_states_the_limits_of_every_axis(browser_client: httpx.Client) -> None:
    text = browser_client.get("/pages/rig", params={"rig": "rx130l-joint3-simulated"}).text
    assert "At rest, bus closed" in text
    assert re.search(r"1\.20 <span class=\"unit\">rad/s</span>", text)


def test_an_unknown_rig_is_answered_with_those_there_are(browser_client: httpx.Client) -> None:
    response = browser_client.get("/pages/rig", params={"rig": "nowhere"})
    assert response.status_code == 404
    assert "There is no rig nowhere; there are" in response.text


def test_before_the_first_plan_the_form_says_what_to_do(browser_client: httpx.Client) -> None:
    text = browser_client.get("/pages/new-session", params={"rig": "rx130l-joint3-simulated"}).text
    assert "Make a plan first" in text
    assert re.search(r"Prepare the session</button>", text)
    assert re.search(r"disabled[^>]*>Prepare the session", text)


def test_with_nothing_under_way_the_stop_says_so(browser_client: httpx.Client) -> None:
    page = browser_client.get("/pages/rig").text
    token = re.search(r'name="csrf-token" content="([^"]+)"', page)
    assert token is not None
    response = browser_client.post("/pages/stop", headers={"X-CSRF-Token": token[1]})
    assert response.json() == {"stopped": [], "words": "Nothing was moving."}


def test_a_stop_from_another_site_is_refused(browser_client: httpx.Client) -> None:
    response = browser_client.post("/pages/stop", headers={"Origin": "http://elsewhere.example"})
    assert response.status_code == 403


def test_static_files_are_only_those_of_the_pages(browser_client: httpx.Client) -> None:
    page = browser_client.get("/pages/rig").text
    style = re.search(r'href="(/pages/static/[^"]+/instrument\.css)"', page)
    assert style is not None
    response = browser_client.get(style[1])
    assert response.status_code == 200
    assert "immutable" in response.headers["cache-control"]
    outside = style[1].replace("instrument.css", "..%2F..%2Frouter.py")
    assert browser_client.get(outside).status_code == 404
