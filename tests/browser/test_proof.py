"""The proof on the drive as an operator lives it: asked for after an identification, driven twice, seen by speed and quadrant."""

import re

import pytest
from playwright.sync_api import expect

from tests.api.driven_arm import short_plan, write_driven_arm
from tests.browser.conftest import SCREENSHOTS
from tests.browser.test_accessibility import violations
from tests.browser.test_story import run_a_session

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]

PATIENCE = 120_000  # ms for what computes or moves
PHONE = {"width": 390, "height": 844}


def shots(ada, name: str) -> None:
    """The page in both themes, and on a phone, where nothing may be wider than the screen."""
    ada.shot(name, narrow=False)
    ada.page.set_viewport_size(PHONE)
    for theme in ("light", "dark"):
        ada.page.emulate_media(color_scheme=theme)
        assert violations(ada.page) == []
        ada.page.screenshot(path=SCREENSHOTS / f"{name}-phone-{theme}.png", full_page=True)
    assert ada.page.evaluate("() => document.documentElement.scrollWidth") <= PHONE["width"]
    ada.page.emulate_media(color_scheme="light")
    ada.page.set_viewport_size({"width": 1280, "height": 800})


def test_a_model_is_proved_on_the_drive_from_the_result_to_the_errors(laboratory_with, visitor) -> None:
    laboratory = laboratory_with()
    service = laboratory.application.state.service
    with service.experiments.incoming() as folder:
        write_driven_arm(folder, service.rigs.rig("bench"))
        experiment = service.experiments.adopt(folder, "arm").id
    service.plans.add(short_plan("up and down"))
    service.models.fit(experiment, "ada", "load-velocity", [])
    ada = visitor(laboratory, "ada")
    page = ada.page
    ada.open(f"experiments/{experiment}/results")
    page.get_by_role("link", name="Prove it on the drive").click(timeout=PATIENCE)
    page.get_by_label("Rig").select_option("bench")
    expect(page).to_have_url(re.compile("rig=bench"))
    shots(ada, "proofs")
    page.get_by_role("button", name="Prepare the proof").click()
    expect(page).to_have_url(re.compile(r"/proofs/00$"), timeout=PATIENCE)
    page.get_by_role("button", name="Prepare the first run").click()
    expect(page).to_have_url(re.compile(r"/sessions/proof-00-without"))
    run_a_session(page, "0")
    page.get_by_role("link", name="Continue the proof").click(timeout=PATIENCE)
    page.get_by_role("button", name="Prepare the second run").click()
    expect(page.locator("[data-proof]")).to_contain_text("A of feedforward, stopped at a following error of")
    ada.shot("proof-second-drive", narrow=False)
    run_a_session(page, "0")
    page.get_by_role("link", name="See the comparison").click(timeout=PATIENCE)
    expect(page.locator("[data-following]")).to_contain_text("driven by its load")
    expect(page.locator(".rail-now")).to_contain_text("follows better")
    shots(ada, "proof")
    ada.open(f"experiments/{experiment}/proofs")
    expect(page.locator("[data-proofs]")).to_contain_text("follows better")
