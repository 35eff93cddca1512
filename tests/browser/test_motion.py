"""While the robot moves: the stop, a fault of a drive, two operators, a connection that breaks and comes back."""

import re

import httpx
import pytest
from playwright.sync_api import Page, expect

from daq.excitation.standard_plan import standard_plan
from daq.session_events import SessionState
from tests.browser.test_accessibility import violations

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

PATIENCE = 200_000  # ms for what computes or moves
PHONE, TABLET = {"width": 390, "height": 844}, {"width": 820, "height": 1180}
SIGNS = "[data-live-state], .watch .label, .watch .value, [data-run-title], [data-stop], [data-connection]"
"""What a person with a phone looks at while the robot moves."""
FAULT_CYCLE = 3000
LASTING = 3600
"""s of a motion that lasts until somebody stops it. It runs in simulated time, where a machine that is busy with a browser
makes it late and nothing else: in real time such a machine stops it, by right (tests/faults/test_held_up.py)."""


def overlaps(page: Page, selector: str) -> list[str]:
    """Pairs of the visible elements of a selector whose boxes lie on each other, or that are wider than the page."""
    return page.evaluate(
        """(selector) => {
          const found = [...document.querySelectorAll(selector)].map((each) => [each, each.getBoundingClientRect()]);
          const seen = found.filter(([, box]) => box.width > 0 && box.height > 0);
          const wrong = seen.filter(([, box]) => box.right > innerWidth + 1).map(([each]) => `beyond: ${each.textContent}`);
          seen.forEach(([one, a], index) => {
            for (const [other, b] of seen.slice(index + 1)) {
              if (one.contains(other) || other.contains(one)) continue;
              const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
              const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
              if (across > 1 && down > 2) wrong.push(`${one.textContent} on ${other.textContent}`);
            }
          });
          return wrong;
        }""",
        selector,
    )


def prepare(page: Page, laboratory, seconds: int, mistyped: str = "") -> None:
    """From a plan that lies ready to an armed session; with a mass that is typed wrongly first."""
    service = laboratory.application.state.service
    service.plans.add(standard_plan(service.rigs.rig("bench"), seconds, name=f"bench {seconds} s"))
    page.goto(f"{laboratory.address}/pages/new-session?rig=bench")
    page.get_by_label("Name of the new experiment").fill("motion")
    page.get_by_role("button", name="Prepare the session").click()
    expect(page).to_have_url(re.compile(r"/sessions/session-00"))
    page.get_by_role("button", name="Check the rig").click()
    mass = page.get_by_label("Mass in kg")
    if mistyped:
        mass.fill(mistyped, timeout=PATIENCE)
        page.get_by_role("button", name="Enter the mass").click()
        expect(page.locator("[data-refused]")).to_contain_text("kg", timeout=PATIENCE)
        expect(mass).to_have_value(mistyped)
        assert violations(page) == []
    mass.fill("0", timeout=PATIENCE)
    page.get_by_role("button", name="Enter the mass").click()
    page.get_by_role("button", name="I confirm it").click()
    expect(page.locator(".rail-now")).to_contain_text("Arming starts the recorder")
    expect(page.locator(".rail-now")).to_be_focused()  # the keyboard goes on from the next step
    page.get_by_role("button", name="Arm", exact=True).click()
    expect(page.get_by_role("button", name="Start: the robot moves")).to_be_visible(timeout=PATIENCE)


def start(page: Page) -> None:
    page.get_by_role("button", name="Start: the robot moves").click()
    expect(page).to_have_url(re.compile(r"/pages/live"))
    expect(page.locator("[data-live-state]")).to_contain_text("The robot moves")


def test_the_stop_key_ends_the_motion_from_any_page(laboratory_with, visitor) -> None:
    laboratory = laboratory_with()
    ada = visitor(laboratory, "ada")
    page = ada.page
    prepare(page, laboratory, LASTING, mistyped="-3")
    page.evaluate("() => scrollTo(0, document.body.scrollHeight)")
    expect(page.locator(".rail [aria-current]")).to_contain_text("Start")
    expect(page.locator(".rail [aria-current]")).to_be_in_viewport()
    ada.shot("session-armed")
    start(page)
    expect(page.locator("[data-position]")).not_to_have_text("–")
    expect(page.locator("[data-worst-share]")).to_contain_text("%")
    page.wait_for_function("() => Number(document.querySelector('[data-run-progress]').value) > 0")
    assert violations(page) == []
    page.set_viewport_size(PHONE)
    for sign in ("[data-live-state]", "[data-left]", "[data-worst-share]", "[data-stop]"):
        expect(page.locator(sign)).to_be_in_viewport()
    assert overlaps(page, SIGNS) == []
    ada.shot("live")
    ada.step("Rig")
    expect(page.locator("[data-run-bar]")).to_be_visible()
    expect(page.get_by_role("button", name=re.compile("STOP"))).to_be_in_viewport()
    page.keyboard.press("Escape")
    active = laboratory.application.state.service.sessions.active("bench")
    assert active.payload_session.wait(20) == SessionState.ABORTED, active.payload_session.reason
    assert "ada" in active.payload_session.reason
    expect(page.locator("[data-run-bar]")).to_be_hidden()
    expect(page.locator(".rig-state")).to_contain_text("Stopped by ada")
    expect(page.locator("main")).not_to_contain_text("coulomb recover")
    page.locator("[data-checks] summary").click()
    page.wait_for_event("response", lambda answer: "/rig/state" in answer.url)
    page.wait_for_event("response", lambda answer: "/rig/state" in answer.url)
    expect(page.locator("[data-checks] details")).to_have_attribute("open", "")
    ada.step("Live")
    expect(page.locator("[data-fault]")).to_contain_text("The session was stopped. Stopped by ada")
    expect(page.locator("[data-live-state]")).to_have_text("Stopped")
    expect(page.locator("[data-connection]")).to_have_text("Nothing moves")
    assert violations(page) == []
    page.get_by_role("link", name="Prepare it again").click()
    expect(page).to_have_url(re.compile(r"/new-session\?rig=bench&experiment=motion"))


def test_a_viewer_may_stop_by_one_press_of_the_button(laboratory_with, visitor) -> None:
    laboratory = laboratory_with()
    ada, vera = visitor(laboratory, "ada"), visitor(laboratory, "vera")
    prepare(ada.page, laboratory, LASTING)
    start(ada.page)
    vera.open("live")
    vera.page.get_by_role("button", name=re.compile("STOP")).click()
    active = laboratory.application.state.service.sessions.active("bench")
    assert active.payload_session.wait(20) == SessionState.ABORTED, active.payload_session.reason
    expect(ada.page.locator("[data-fault]")).to_contain_text("Stopped by vera")


def test_a_drive_fault_is_said_in_words_on_the_live_page(laboratory_with, visitor) -> None:
    laboratory = laboratory_with(faults={"emergency_at": FAULT_CYCLE, "emergency_code": 0x4310})
    ada = visitor(laboratory, "ada")
    prepare(ada.page, laboratory, 60)
    ada.page.get_by_role("button", name="Start: the robot moves").click()
    fault = ada.page.locator("[data-fault]")
    expect(fault).to_contain_text("A fault ended the session.", timeout=PATIENCE)
    expect(fault).to_contain_text("motor or transmission too hot")
    expect(fault).to_contain_text("samples are kept")
    expect(fault).to_contain_text("Remove the cause at the machine")
    ada.shot("fault")
    ada.step("Rig")
    expect(ada.page.locator(".rig-state")).to_contain_text("remove the cause at the machine")
    ada.shot("rig-fault")
    # Where power could not be read back as off, a person is told on every page, until that is taken back.
    session = laboratory.application.state.service.sessions.active("bench").payload_session
    session.alarm = "joint j3 may still have power: press the emergency stop"
    alarm = ada.page.get_by_role("alert").and_(ada.page.locator("[data-alarm]"))
    for page in ("Results", "Rig"):
        expect(alarm).to_have_text(f"bench: {session.alarm}")
        expect(alarm).to_be_in_viewport()
        ada.step(page)
    ada.page.reload()
    expect(alarm).to_be_visible()
    session.alarm = ""
    expect(alarm).to_be_hidden()


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


def test_six_joints_stand_on_one_screen_and_their_numbers_do_not_touch(laboratory_with, visitor) -> None:
    """As in motion: everything is shown, with the widest numbers that there are."""
    laboratory = laboratory_with()
    ada = visitor(laboratory, "ada")
    page = ada.page
    ada.open("live?rig=tx40-simulated")
    expect(page.locator("[data-live-state]")).to_have_text("Nothing moves")
    page.evaluate(
        """() => {
          for (const part of document.querySelectorAll("[data-seen], [data-run-bar]")) part.hidden = false;
          for (const part of document.querySelectorAll("[data-idle]")) part.hidden = true;
          for (const part of document.querySelectorAll(".axis-values .value > :first-child")) part.textContent = "−188.88";
        }"""
    )
    for size in ({"width": 1280, "height": 800}, TABLET, PHONE):
        page.set_viewport_size(size)
        assert overlaps(page, ".axis-values .value > *, .axis-values .label") == [], size
    page.set_viewport_size({"width": 1280, "height": 800})
    # Shown and measured at once: what is asked for once a second hides the bar again, since nothing moves.
    beneath, bar = page.evaluate(
        """() => {
          const bar = document.querySelector("[data-run-bar]");
          bar.hidden = false;
          const axes = document.querySelectorAll("[data-axis]");
          return [axes[axes.length - 1].getBoundingClientRect().bottom, bar.getBoundingClientRect().top];
        }"""
    )
    assert beneath <= bar
    ada.shot("live-six")


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
