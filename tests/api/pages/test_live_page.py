"""The live page before anything moves: its axes with their limits, and the words that it shares with every page's bar."""

import html
import json
import re

import httpx

from daq.rig import Rig
from daq.session_events import SessionState

LIVE = "/pages/live?rig=tx40-simulated"


def attribute(text: str, name: str) -> list[str]:
    """Values of an attribute, in the page's order."""
    return [html.unescape(value) for value in re.findall(rf'{name}="([^"]*)"', text)]


def test_every_axis_has_its_limits_and_its_row_of_the_drive_gain(browser_client: httpx.Client) -> None:
    text, rig = browser_client.get(LIVE).text, Rig.load("tx40-simulated")
    assert attribute(text, "data-joint") == [axis.joint for axis in rig.axes]
    assert [float(value) for value in attribute(text, "data-high")] == [
        axis.limits.position[1] for axis in rig.axes
    ]
    gains = [json.loads(value) for value in attribute(text, "data-gain")]
    assert gains == rig.drive_gain.tolist()
    # the wrist: motor 6 acts on joint 5 too
    assert gains[4][5] != 0.0


def test_each_state_says_the_same_on_the_page_and_in_the_bar(browser_client: httpx.Client) -> None:
    states = json.loads(attribute(browser_client.get(LIVE).text, "data-states")[0])
    assert set(states) == {"", *(state.value for state in SessionState)}
    assert states["running"] == {"kind": "warn", "short": "Moving", "long": "The robot moves", "moves": True}
    at_rest = [each for name, each in states.items() if name not in ("armed", "running")]
    assert {each["short"] for each in at_rest} == {"Nothing moves"}
    assert browser_client.get("/pages/run-state").json()["rig_words"] == "Nothing moves"


def test_a_rig_that_measured_nothing_yet_has_no_outcome_but_the_way_to_its_first_session(
    browser_client: httpx.Client,
) -> None:
    assert "data-outcome" not in browser_client.get("/pages/live/outcome?rig=tx40-simulated").text
    assert "New session</a>" in browser_client.get(LIVE).text
