"""A proof's first run with others at the rig: who is refused, in words, what a viewer sees and stops, and what a reload keeps."""

import re

import pytest
from playwright.sync_api import Page, Route, expect

import api.service.drive_work as drive_work
from api.service.accounts import Role, User
from daq.session_events import SessionState
from tests.api.driven_arm import short_plan, write_driven_arm
from tests.browser.test_proof import PATIENCE, shots
from tests.browser.test_story import run_a_session

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


def prepare_a_proof(page: Page) -> None:
    page.get_by_role("button", name="Prepare the proof").click()
    expect(page).to_have_url(re.compile(r"/proofs/00$"), timeout=PATIENCE)


def compute_tables(page: Page) -> None:
    page.get_by_role("button", name="Compute the tables").click()
    expect(page.get_by_role("button", name="Write and read back")).to_be_visible(timeout=PATIENCE)


def answered_after_news(route: Route) -> None:
    """Let an answer wait until the page was told by its news, twice, that it is out of date: one that was drawn anew at the
    first is not told again."""
    answer = route.fetch()
    for _ in range(2):
        with route.request.frame.page.expect_response(lambda each: "hx-refresh" in each.headers):
            pass
    route.fulfill(response=answer)


def test_others_at_the_rig_see_a_run_of_a_proof_cannot_disturb_it_and_can_stop_it(
    laboratory_with, visitor, monkeypatch
) -> None:
    # The page offers to write tables where drives last; these here would, were it not refused before.
    monkeypatch.setattr(drive_work, "require_lasting_drives", lambda rig: None)
    laboratory = laboratory_with()
    service = laboratory.application.state.service
    with service.experiments.incoming() as folder:
        write_driven_arm(folder, service.rigs.rig("bench"))
        experiment = service.experiments.adopt(folder, "arm").id
    plan = short_plan("again and again")
    # it lasts longer than all that is looked at here
    service.plans.add(plan.model_copy(update={"phases": plan.phases * 12}))
    service.models.fit(experiment, "ada", "load-velocity", [])
    ada, grace, vera = (visitor(laboratory, name) for name in ("ada", "grace", "vera"))
    ada.open(f"experiments/{experiment}/results")
    expect(ada.page.get_by_role("link", name="Prove it on the drive")).to_be_visible(timeout=PATIENCE)
    ada.open(f"experiments/{experiment}/proofs?rig=bench")
    prepare_a_proof(ada.page)
    grace.open(f"experiments/{experiment}/drive-tables?rig=bench")
    compute_tables(grace.page)
    shots(grace, "drive-tables")
    tables, proof = grace.page.url, ada.page.url
    refusal = grace.page.locator("#problem")

    service.operators.take("bench", User("ada", Role.OPERATOR, "password"))
    grace.page.goto(proof)
    grace.page.get_by_role("button", name="Prepare the first run").click()
    expect(refusal).to_contain_text("ada operates the rig bench")
    ada.page.route(re.compile(r"/drives/without$"), answered_after_news)
    ada.page.get_by_role("button", name="Prepare the first run").click()
    expect(ada.page).to_have_url(re.compile(r"/sessions/proof-00-without"))
    # the page that still offered to prepare it draws itself anew
    expect(grace.page.get_by_role("link", name="See the run")).to_be_visible()
    expect(grace.page.locator(".rail-now")).to_contain_text("ada operates the rig. You can watch")
    # while nothing changes: the page of the proof draws itself anew at every step of the run
    grace.page.goto(tables)
    run_a_session(ada.page, "0")
    expect(ada.page.locator("[data-live-state]")).to_contain_text("The robot moves")

    grace.page.on("dialog", lambda dialog: dialog.accept())
    grace.page.get_by_role("button", name="Write and read back").click()
    expect(refusal).to_contain_text("ada operates the rig bench")
    assert service.drive_tables.writings(experiment) == []
    ada.page.reload()
    expect(ada.page.locator("[data-live-state]")).to_contain_text("The robot moves")
    ada.page.goto(proof)
    ada.page.reload()
    expect(ada.page.get_by_role("link", name="Continue the run")).to_be_visible()

    vera.page.goto(proof)
    expect(vera.page.get_by_role("link", name="See the run")).to_be_visible()
    shots(vera, "proof-watched")
    vera.page.get_by_role("button", name=re.compile("STOP")).click()
    active = service.sessions.active("bench")
    assert active.payload_session.wait(20) == SessionState.ABORTED, active.payload_session.reason
    for each in (ada, vera):
        expect(each.page.locator("[data-fault]")).to_contain_text("stopped by vera. ")
    expect(ada.page.get_by_role("button", name="Prepare the first run")).to_be_visible()
    expect(vera.page.locator(".rail-now")).to_contain_text("Only an operator can prepare it.")
    shots(ada, "proof-stopped")
    # what the browser itself says of the two answers that refuse
    assert [line for line in grace.errors if "409" not in line] == []
    grace.errors.clear()
