"""A page that draws itself anew when it has news does not break off what somebody asked for meanwhile."""

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, Route, expect

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]

MODEL = "experiments/rx130l-joint3/model"
NEWS = re.compile(r"/experiments/rx130l-joint3/news\?")


def out_of_date(page: Page) -> list[str]:
    """Every news from now on is that the page is out of date. The addresses that were asked for it."""
    asked: list[str] = []

    def tell(route: Route) -> None:
        asked.append(route.request.url)
        route.fulfill(status=204, headers={"HX-Refresh": "true"})

    page.route(NEWS, tell)
    return asked


def after_news(page: Page, asked: list[str]) -> Callable[[Route], None]:
    """Let an answer wait until the page was told twice that it is out of date."""

    def wait(route: Route) -> None:
        answer = route.fetch()
        # a page that is drawn anew asks again too; whether the answer still has somewhere to go is what is tested
        for _ in range(2):
            with page.expect_response(NEWS):
                pass
        assert len(asked) >= 2
        route.fulfill(response=answer)

    return wait


def test_a_link_leads_where_it_says_while_the_page_has_news(stored, visitor) -> None:
    ada = visitor(stored, "ada")
    page = ada.page
    ada.open(MODEL)
    page.route(re.compile("/experiments/rx130l-joint3/results$"), after_news(page, out_of_date(page)))
    ada.step("Results")
    expect(page).to_have_url(re.compile("/results$"))


def test_a_choice_is_shown_while_the_page_has_news(stored, visitor) -> None:
    """A form that is sent as it is changed, and leads to the same page with another address."""
    ada = visitor(stored, "ada")
    page = ada.page
    ada.open(MODEL)
    page.route(re.compile("/model[?]"), after_news(page, out_of_date(page)))
    page.get_by_role("navigation", name="Session").get_by_role("link", name="1 · none").click()
    expect(page).to_have_url(re.compile("/model[?]"))


def test_news_that_waited_for_a_page_that_never_came_are_shown_all_the_same(stored, visitor) -> None:
    """A link to a file that is kept, and not shown, leads nowhere."""
    ada = visitor(stored, "ada")
    page = ada.page
    page.clock.install()
    ada.open(MODEL)
    page.clock.resume()
    page.evaluate("window.stays = true")
    page.route(re.compile("/experiments/rx130l-joint3/results$"), lambda route: route.fulfill(status=204))
    asked = out_of_date(page)
    ada.step("Results")
    while len(asked) < 2:
        with page.expect_response(NEWS):
            pass
    assert page.evaluate("window.stays")
    page.clock.fast_forward(20_000)
    page.wait_for_function("!window.stays")
