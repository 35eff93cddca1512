"""axe-core finds nothing on any page, in either theme; keys can be switched off; progress and state are read aloud."""

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect

from daq.excitation.standard_plan import standard_plan

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

PATIENCE = 120_000  # ms for what computes


def addresses(experiment: str) -> list[str]:
    """Every page, with something to show."""
    of_experiment = (
        "model",
        "model?session=session-00.csv",
        "missing",
        "results",
        "drive-tables",
        "sessions",
        "report",
    )
    return [
        "rig?rig=bench",
        "new-session?rig=bench",
        "new-session?rig=bench&payload=new",
        "live",
        "experiments",
        *(f"experiments/{experiment}/{each}" for each in of_experiment),
        "account",
        "users",
        "audit",
        "records",
        "../docs",
        "nothing-is-here",
    ]


def scrolled_on_a_phone(experiment: str) -> list[str]:
    """Pages with tables that are wider than a phone, which must be reached from the keyboard there."""
    return [f"experiments/{experiment}/model", f"experiments/{experiment}/results"]


def violations(page) -> list[str]:
    """What axe finds on the page as it stands, each with where."""
    found = Axe().run(page).response["violations"]
    return [f"{each['id']}: {node['html'][:120]}" for each in found for node in each["nodes"]]


def unnamed(page) -> list[str]:
    """Tables and pictures that a screen reader would announce without saying what they are, and buttons that say the same
    while they do different things."""
    return page.evaluate(
        """() => {
          const bare = (part) => !part.ariaLabel && !part.getAttribute("aria-labelledby");
          const parts = [...document.querySelectorAll("table, [role=img], canvas")].filter(
            (part) => !part.closest("[aria-hidden=true], .uplot") && bare(part) && !part.querySelector(":scope > caption"));
          const buttons = document.querySelectorAll("button[hx-post]");
          const named = Map.groupBy(buttons, (button) => button.ariaLabel ?? button.innerText);
          const does = (group) => new Set(group.map((each) => each.getAttribute("hx-post"))).size;
          const alike = [...named.values()].filter((group) => does(group) > 1);
          return [...parts, ...alike.map(([first]) => first)].map((part) => part.outerHTML.slice(0, 120));
        }"""
    )


def test_axe_finds_nothing_on_any_page_in_either_theme(measured, visitor, chromium) -> None:
    laboratory, experiment = measured
    service = laboratory.application.state.service
    service.plans.add(standard_plan(service.rigs.rig("bench"), 20, name="bench 20 s"))
    root = visitor(laboratory, "root")
    page = root.page
    root.open(f"experiments/{experiment}/missing")
    expect(page.locator(".verdict .sentence")).to_contain_text("The model misses", timeout=PATIENCE)
    found = {}
    for address in addresses(experiment):
        root.open(address)
        page.wait_for_load_state()
        if address in scrolled_on_a_phone(experiment):
            page.set_viewport_size({"width": 390, "height": 844})
            expect(page.locator(".scroll[tabindex]").first).to_be_visible()
            if mistakes := violations(page):
                found[f"{address}, phone"] = mistakes
            page.set_viewport_size({"width": 1280, "height": 800})
        for theme in ("light", "dark"):
            page.emulate_media(color_scheme=theme)
            if mistakes := violations(page):
                found[f"{address}, {theme}"] = mistakes
        if mistakes := unnamed(page):
            found[f"{address}, names"] = mistakes
    root.errors.clear()  # the browser says that one of the addresses is not there
    assert found == {}
    stranger = chromium.new_context().new_page()
    stranger.goto(f"{laboratory.address}/pages/sign-in")
    assert violations(stranger) == []
    stranger.context.close()


def test_single_keys_are_switched_off_and_progress_is_read_aloud(measured, visitor) -> None:
    laboratory, experiment = measured
    ada = visitor(laboratory, "ada")
    page = ada.page
    ada.open(f"experiments/{experiment}/missing")
    expect(page.locator("[data-announcer]")).to_contain_text("Looking for what is missing", timeout=PATIENCE)
    expect(page.locator(".candidate .primary")).to_be_visible(timeout=PATIENCE)
    ada.open("account")
    page.get_by_label("Single-key shortcuts").uncheck()
    ada.open(f"experiments/{experiment}/missing")
    expect(page.locator(".candidate .primary")).to_be_visible()
    page.keyboard.press("a")
    assert laboratory.application.state.service.models.story(experiment).read().line == ["m1"]
    expect(page.locator("[data-connection]")).to_have_attribute("role", "status")
