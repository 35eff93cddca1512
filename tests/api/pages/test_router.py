"""Where the service's address leads, and what a browser sees when something is wrong."""

import re

import httpx

from api.service.accounts import Role


def test_the_address_leads_to_the_rig_once_there_is_an_experiment(browser_client: httpx.Client) -> None:
    assert browser_client.get("/", follow_redirects=False).headers["location"] == "/pages/rig"


def test_a_wrong_form_is_answered_in_words_where_htmx_shows_them(browser_client: httpx.Client) -> None:
    page = browser_client.get("/pages/rig").text
    token = re.search(r'name="csrf-token" content="([^"]+)"', page)
    assert token is not None
    headers = {"X-CSRF-Token": token[1], "HX-Request": "true"}
    response = browser_client.post("/pages/plans", data={"rig": "bench", "seconds": "-1"}, headers=headers)
    assert response.status_code == 422
    assert response.headers["hx-retarget"] == "#problem"
    assert "seconds" in response.text
    assert "seconds: must be greater than 0" in response.text
    assert "role=" not in response.text  # its place is an alert: one in the other would be read twice


def test_a_browser_that_is_not_signed_in_is_led_to_the_sign_in(service):
    service.client(Role.ADMIN)
    answer = service.client().post(
        "/pages/experiments/import", headers={"HX-Request": "true", "Accept": "text/html"}
    )
    assert answer.status_code == 401
    assert answer.headers["HX-Redirect"].startswith("/pages/sign-in")


def test_before_there_is_an_experiment_the_address_leads_to_the_ways_to_a_first_one(service):
    viewer = service.client(Role.VIEWER)
    for address in ("/", "/pages", "/pages/"):
        answer = viewer.get(address, headers={"Accept": "text/html"}, follow_redirects=False)
        assert (answer.status_code, answer.headers["location"]) == (307, "/pages/experiments")


def test_whoever_follows_a_link_signs_in_and_comes_back_to_it(service):
    service.client(Role.ADMIN)
    stranger = service.client()
    stranger.headers["Accept"] = "text/html"
    answer = stranger.get("/pages/experiments/an arm/model", follow_redirects=False)
    assert answer.status_code == 303
    assert answer.headers["location"] == "/pages/sign-in?then=/pages/experiments/an%20arm/model"


def test_a_problem_is_a_page_of_its_own_except_where_htmx_asked(browser_client: httpx.Client) -> None:
    missing = "/pages/experiments/nowhere/model"
    page, part = browser_client.get(missing), browser_client.get(missing, headers={"HX-Request": "true"})
    assert (page.status_code, part.status_code) == (404, 404)
    assert "<h1>Not found</h1>" in page.text
    assert "hx-retarget" not in page.headers
    assert "<h1" not in part.text
    assert (part.headers["hx-retarget"], part.headers["hx-reswap"]) == ("#problem", "innerHTML")


def test_a_wrong_field_is_named_as_its_form_calls_it(browser_client: httpx.Client) -> None:
    address = "/pages/experiments/rx130l-joint3/news"
    text = browser_client.get(address, params={"seen": "x" * 41}).text
    assert "<p>seen: String should have at most 40 characters</p>" in text
