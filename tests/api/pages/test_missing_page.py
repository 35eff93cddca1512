"""What is missing: the verdict, the ranked effects and the staircase of the error."""

import re

import httpx

MISSING = "/pages/experiments/rx130l-joint3/missing"


def test_the_verdict_is_one_sentence_that_names_the_effect(browser_client: httpx.Client) -> None:
    text = browser_client.get(MISSING).text
    sentence = re.search(r'class="sentence"[^>]*>([^<]+)<', text)
    assert sentence is not None
    assert sentence[1] == "The model misses friction that depends on load and speed together."


def test_candidates_stand_in_the_order_of_their_rank(browser_client: httpx.Client) -> None:
    text = browser_client.get(MISSING).text
    assert re.findall(r'data-candidate="([^"]+)"', text) == ["load-stribeck", "stribeck", "viscous-power"]


def test_only_the_first_candidate_has_a_filled_button(browser_client: httpx.Client) -> None:
    text = browser_client.get(MISSING).text
    assert len(re.findall(r'class="primary" data-key="a"', text)) == 1


def test_the_staircase_shows_what_stands_and_what_was_undone(browser_client: httpx.Client) -> None:
    text = browser_client.get(MISSING).text
    assert len(re.findall(r'class="node now"', text)) == 1
    assert len(re.findall(r'class="node undone"', text)) == 1
    assert "noise floor 2.10" in text


def test_the_effect_added_last_shows_the_residual_before_and_after(browser_client: httpx.Client) -> None:
    fragment = browser_client.get(f"{MISSING}/evidence", params={"effect": "load-friction-asymmetric"}).text
    assert "without it" in fragment
    assert "with it" in fragment
    assert 'class="band"' in fragment
    assert 'class="band before"' in fragment


def test_what_cannot_be_told_apart_is_said(browser_client: httpx.Client) -> None:
    text = browser_client.get(MISSING).text
    assert "cannot tell friction that depends on load and speed together from friction that falls" in text
