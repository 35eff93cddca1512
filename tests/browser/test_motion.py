"""While the robot moves: the stop, a fault of a drive, two operators, a connection that breaks and comes back."""

import re

import httpx
import pytest
from playwright.sync_api import Page, expect

from daq.excitation.standard_plan import standard_plan
from daq.session_events import SessionState

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

PATIENCE = 200_000  # ms for what computes or moves
FAULT_CYCLE = 3000
LASTING = 3600
"""s of a motion that lasts until somebody stops it. It runs in simulated time, where a machine that is busy with a browser
makes it late and nothing else: in real time such a machine stops it, by right (tests/faults/test_held_up.py)."""


def prepare(page: Page, laboratory, seconds: int) -> None:
    """From a plan that lies ready to an armed session."""
    service = laboratory.application.state.service
    service.plans.add(standard_plan(service.rigs.rig("bench"), seconds, name=f"bench {seconds} s"))
    page.goto(f"{laboratory.address}/pages/new-session?rig=bench")
    page.get_by_label("Name of the new experiment").fill("motion")
    page.get_by_role("button", name="Prepare the session").click()
    page.wait_for_url(re.compile(r"/sessions/session-00"))
    page.get_by_role("button", name="Check the rig").click()
    page.get_by_label("Mass in kg").fill("0", timeout=PATIENCE)
    page.get_by_role("button", name="Enter the mass").click()
    page.get_by_role("button", name="I confirm it").click()
    page.get_by_role("button", name="Arm", exact=True).click()
    expect(page.get_by_role("button", name="Start: the robot moves")).to_be_visible(timeout=PATIENCE)


def start(page: Page) -> None:
    page.get_by_role("button", name="Start: the robot moves").click()
    page.wait_for_url(re.compile(r"/pages/live"))
    expect(page.locator("[data-live-state]")).to_contain_text("The robot moves")


def test_the_stop_key_ends_the_motion_from_any_page(laboratory_with, visitor) -> None:
    laboratory = laboratory_with()
    ada = visitor(laboratory, "ada")
    page = ada.page
    prepare(page, laboratory, LASTING)
    ada.shot("session-armed")
    start(page)
    expect(page.locator("[data-position]")).not_to_have_text("–")
    page.wait_for_function("() => Number(document.querySelector('[data-run-progress]').value) > 0")
    ada.shot("live")
    ada.step("Rig")
    expect(page.locator("[data-run-bar]")).to_be_visible()
    expect(page.get_by_role("button", name=re.compile("STOP"))).to_be_in_viewport()
    page.keyboard.press("Escape")
    active = laboratory.application.state.service.sessions.active("bench")
    assert active.payload_session.wait(20) == SessionState.ABORTED, active.payload_session.reason
    assert "ada" in active.payload_session.reason
    expect(page.locator("[data-run-bar]")).to_be_hidden()
    expect(page.get_by_text(re.compile("Aborted"))).to_be_visible()
    ada.step("Live")
    expect(page.locator("[data-fault]")).to_contain_text("The session was stopped. stopped by ada")


def test_a_viewer_may_stop_by_one_press_of_the_button(laboratory_with, visitor) -> None:
    laboratory = laboratory_with()
    ada, vera = visitor(laboratory, "ada"), visitor(laboratory, "vera")
    prepare(ada.page, laboratory, LASTING)
    start(ada.page)
    vera.open("live")
    vera.page.get_by_role("button", name=re.compile("STOP")).click()
    active = laboratory.application.state.service.sessions.active("bench")
    assert active.payload_session.wait(20) == SessionState.ABORTED, active.payload_session.reason
    expect(ada.page.locator("[data-fault]")).to_contain_text("stopped by vera")


def test_a_drive_fault_is_said_in_words_on_the_live_page(laboratory_with, visitor) -> None:
    laboratory = laboratory_with(faults={"emergency_at": FAULT_CYCLE, "emergency_code": 0x4310})
    ada = visitor(laboratory, "ada")
    prepare(ada.page, laboratory, 60)
    ada.page.get_by_role("button", name="Start: the robot moves").click()
    fault = ada.page.locator("[data-fault]")
    expect(fault).to_contain_text("A fault ended the session.", timeout=PATIENCE)
    expect(fault).to_contain_text("motor or transmission too hot")
    expect(fault).to_contain_text("What was measured is kept")
    ada.shot("fault")
    ada.step("Rig")
    expect(ada.page.locator(".rig-state")).to_contain_text("remove the cause at the machine")
    ada.shot("rig-fault")


def test_a_second_operator_sees_who_operates_the_rig_and_cannot_take_it(laboratory_with, visitor) -> None:
    laboratory = laboratory_with()
    ada, grace = visitor(laboratory, "ada"), visitor(laboratory, "grace")
    prepare(ada.page, laboratory, 20)
    grace.open("rig?rig=bench")
    expect(grace.page.get_by_text("ada operates the rig").first).to_be_visible()
    expect(grace.page.get_by_role("button", name="Take the rig")).to_have_count(0)
    grace.page.goto(ada.page.url)
    expect(grace.page.get_by_text("You can watch, and you can stop it.")).to_be_visible()
    expect(grace.page.get_by_role("button", name="Start: the robot moves")).to_have_count(0)
    grace.shot("second-operator", narrow=False)
    token = grace.page.locator('meta[name="csrf-token"]').get_attribute("content")
    cookies = {cookie["name"]: cookie["value"] for cookie in grace.context.cookies()}
    path = re.sub(r"^https?://[^/]+", "", ada.page.url)
    answer = httpx.post(f"{laboratory.address}{path}/start", headers={"X-CSRF-Token": token}, cookies=cookies)
    assert answer.status_code == 409
    assert "ada operates the rig" in answer.text
    ada.open("rig?rig=bench")
    expect(ada.page.locator("[data-onlookers]")).to_contain_text("grace is watching")


def test_a_lost_connection_is_said_and_the_page_comes_back_by_itself(laboratory_with, visitor) -> None:
    laboratory = laboratory_with()
    ada = visitor(laboratory, "ada")
    page = ada.page
    prepare(page, laboratory, LASTING)
    start(page)
    expect(page.locator("[data-position]")).not_to_have_text("–")
    ada.context.set_offline(True)
    page.evaluate("() => window.dispatchEvent(new Event('offline'))")
    expect(page.locator("[data-lost]")).to_be_visible(timeout=20_000)
    expect(page.locator("[data-connection]")).to_have_text("No connection")
    expect(page.locator("[data-run-note]")).to_contain_text("use the emergency stop of the machine")
    ada.shot("connection-lost", narrow=False)
    active = laboratory.application.state.service.sessions.active("bench")
    assert active.state == SessionState.RUNNING, active.payload_session.reason
    ada.context.set_offline(False)
    expect(page.locator("[data-lost]")).to_be_hidden(timeout=20_000)
    expect(page.locator("[data-connection]")).to_have_text("Moving")
    ada.errors.clear()  # what the browser itself says of requests while there was no network
    page.get_by_role("button", name=re.compile("STOP")).click()
    assert active.payload_session.wait(20) == SessionState.ABORTED, active.payload_session.reason
