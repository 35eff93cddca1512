"""The catalogue of sessions, and what excluding one does to every error that is shown."""

import re

import pytest
from playwright.sync_api import expect

from daq.excitation.standard_plan import standard_plan

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

PATIENCE = 120_000  # ms for what computes
SCREENS = {"desk": (1280, 800), "tablet": (820, 1180), "phone": (390, 844)}


def fits_on_every_screen(visitor, name: str) -> None:
    """Nothing is wider than its screen, light or dark; screenshots are kept."""
    for screen, (width, height) in SCREENS.items():
        visitor.page.set_viewport_size({"width": width, "height": height})
        wide = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
        assert visitor.page.evaluate(wide) <= 0, f"{name} is wider than the {screen}"
        visitor.shot(f"{name}-{screen}", narrow=False)
    visitor.page.set_viewport_size({"width": 1280, "height": 800})


def test_a_session_is_excluded_with_its_reason_and_every_version_is_fitted_again(measured, visitor) -> None:
    laboratory, experiment = measured
    ada = visitor(laboratory, "ada")
    page = ada.page
    ada.open(f"experiments/{experiment}/missing")
    expect(page.locator(".verdict .sentence")).to_contain_text("The model misses", timeout=PATIENCE)
    expect(page.locator("[data-scope]")).to_contain_text("all 3 sessions of the fit")
    page.locator(".candidate .primary").click()
    expect(page.locator(".step-chart .node")).to_have_count(2, timeout=PATIENCE)

    ada.open(f"experiments/{experiment}/sessions")
    row = page.locator('[data-session="session-02"]')
    row.locator("summary").click()
    row.get_by_label("Exclude it: no model uses it").check()
    row.get_by_role("button", name="Save").click()
    expect(page.locator("#problem")).to_contain_text("Give the reason")
    for _ in range(2):  # the page asks for news every second; an error stays until the user acts
        page.wait_for_event("response", lambda answer: "/news" in answer.url)
    expect(page.locator("#problem")).to_contain_text("Give the reason")
    ada.errors.clear()  # the browser itself says that a request was refused
    row.get_by_label("Reason, if it is excluded").fill("the disk was loose")
    row.get_by_label("Note").fill("measure it again")
    row.get_by_role("button", name="Save").click()
    expect(row).to_contain_text("excluded")
    expect(row).to_contain_text("the disk was loose")
    expect(row).to_contain_text("measure it again")
    fits_on_every_screen(ada, "sessions")

    ada.open(f"experiments/{experiment}/missing")
    scope = page.locator("[data-scope]")
    expect(scope).to_contain_text("all 2 sessions of the fit; session-02.csv excluded", timeout=PATIENCE)
    # Errors are only compared where they are of the same data: the first model follows by itself.
    expect(page.locator(".step-chart .other-data")).to_have_count(0, timeout=PATIENCE)
    expect(page.locator(".step-chart .node")).to_have_count(2)
    story = laboratory.application.state.service.models.story(experiment).read()
    assert len({version.fit.data for version in story.versions}) == 1
    fits_on_every_screen(ada, "missing")

    ada.open(f"experiments/{experiment}/model?session=session-01.csv")
    expect(scope).to_contain_text("Only session-01.csv, in the fit")
    expect(page.get_by_text("Condition number")).to_have_count(0)
    fits_on_every_screen(ada, "model")


def test_the_catalogue_is_sorted_and_filtered(measured, visitor) -> None:
    laboratory, experiment = measured
    vera = visitor(laboratory, "vera")
    page = vera.page
    vera.open(f"experiments/{experiment}/sessions")
    names = page.locator("[data-session] th b")
    expect(names).to_have_text(["session-00", "session-01", "session-02"])
    page.get_by_role("link", name=re.compile("^session")).click()
    expect(names).to_have_text(["session-02", "session-01", "session-00"])
    page.locator("select[name=payload]").first.select_option("disk")
    expect(names).to_have_text(["session-01"])
    page.get_by_role("link", name="Show all 3").click()
    expect(names).to_have_count(3)
    expect(page.locator(".row-menu")).to_have_count(0)  # a viewer changes nothing


def test_a_rig_is_offered_its_own_experiment_and_another_ones_is_warned_of(measured, visitor) -> None:
    laboratory, _experiment = measured
    service = laboratory.application.state.service
    service.plans.add(standard_plan(service.rigs.rig("bench"), 20, name="bench 20 s"))
    service.experiments.create(service.rigs.experiment_file("bench", "somebody's"))
    row = service.experiments.rows()[0]
    folder = service.experiments.folder(row.id)
    (folder / "session-00.csv").write_text("t,q1,v1\n" + "".join(f"{i / 100},{i},1\n" for i in range(100)))
    from identify.recording import DeclaredSession, append_session

    append_session(folder, DeclaredSession(file="session-00.csv", payload="none"))
    ada = visitor(laboratory, "ada")
    page = ada.page
    ada.open("new-session?rig=bench")
    expect(page.get_by_label("Name of the new experiment")).to_be_visible()  # nobody's is taken by itself
    page.locator("select[name=experiment]").select_option(row.id)
    warning = page.locator("[data-other-rig]")
    expect(warning).to_contain_text(
        "somebody's were measured on a rig that is not named; the rig chosen is bench"
    )
    fits_on_every_screen(ada, "other-rig")
    page.locator("select[name=rig]").select_option("rx130l-joint3-simulated")
    expect(page.get_by_label("Name of the new experiment")).to_be_visible()
