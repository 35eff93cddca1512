"""The page of the drives' tables before any was computed, and what is typed into its address or form by mistake."""

import re

import httpx

PAGE = "/pages/experiments/rx130l-joint3/drive-tables"
RIG = "rx130l-joint3-simulated"


def test_nothing_is_computed_or_written_by_looking(browser_client: httpx.Client) -> None:
    text = browser_client.get(PAGE).text
    assert "The tables are shown here" in text
    assert "Nothing was written from this experiment." in text
    assert "Compute the tables</button>" in text
    assert f"<option selected>{RIG}</option>" in text
    assert "Write and read back" not in text
    # from the panels beside the proof
    for page in ("model", "results"):
        assert PAGE in browser_client.get(f"/pages/experiments/rx130l-joint3/{page}").text


def test_a_model_a_rig_and_a_writing_that_there_are_not_are_said_in_one_line(
    browser_client: httpx.Client,
) -> None:
    assert browser_client.get(PAGE, params={"version": "9"}).status_code == 404
    token = re.search(r'name="csrf-token" content="([^"]+)"', browser_client.get(PAGE).text)
    assert token
    headers = {"X-CSRF-Token": token[1]}
    for fields in ({"rig": RIG, "version": "9"}, {"rig": "none", "version": "1"}):
        for address in ("compute", "write"):
            answer = browser_client.post(f"{PAGE}/{address}", data=fields, headers=headers)
            assert answer.status_code == 404, answer.text
    early = browser_client.post(f"{PAGE}/write", data={"rig": RIG, "version": "1"}, headers=headers)
    assert (early.status_code, "were not computed yet" in early.text) == (409, True)
    assert browser_client.post(f"{PAGE}/writings/00/back", headers=headers).status_code == 404
