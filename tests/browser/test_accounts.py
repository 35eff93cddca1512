"""Sign-in, one's own account, users and the audit log, as people use them."""

import re

import pytest
from playwright.sync_api import expect

from tests.api.short_demo import short_plan
from tests.browser.test_accessibility import violations

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]


def test_a_wrong_password_is_said_on_the_form(laboratory_with, visitor, chromium) -> None:
    laboratory = laboratory_with()
    root = visitor(laboratory, "root")
    root.page.get_by_role("link", name=re.compile("root")).click()
    root.page.get_by_role("button", name="Sign out").click()
    expect(root.page).to_have_url(re.compile("/pages/sign-in"))
    root.shot("sign-in")
    root.page.get_by_label("Name").fill("ada")
    root.page.get_by_label("Password").fill("something else")
    root.page.get_by_role("button", name="Sign in").click()
    expect(root.page.locator("#problem")).to_contain_text("The name or the password is wrong.")
    root.errors.clear()  # the browser notes the refused request


def test_a_page_that_needs_a_sign_in_leads_there_and_back(laboratory_with, chromium, visitor) -> None:
    laboratory = laboratory_with()
    context = chromium.new_context()
    page = context.new_page()
    page.goto(f"{laboratory.address}/pages/experiments")
    expect(page).to_have_url(re.compile(r"/pages/sign-in\?then="))
    page.get_by_label("Name").fill("vera")
    page.get_by_label("Password").fill("correct horse battery")
    page.get_by_role("button", name="Sign in").click()
    expect(page).to_have_url(re.compile("/pages/experiments$"))
    expect(page.get_by_text("No experiment yet")).to_be_visible()
    context.close()


def test_a_first_visit_is_one_click_from_a_result(laboratory_with, visitor) -> None:
    laboratory = laboratory_with()
    demos = laboratory.application.state.service.demos
    demos.plan = laboratory.folder / "short.json"
    demos.plan.write_text(short_plan())
    vera = visitor(laboratory, "vera")
    vera.open("experiments")
    expect(vera.page.get_by_text("An operator can start it")).to_be_visible()
    ada = visitor(laboratory, "ada")
    ada.open("experiments")
    for way in ("Try it on the simulated arm", "Upload a record", "Connect a rig"):
        expect(ada.page.get_by_role("heading", name=way)).to_be_visible()
    assert violations(ada.page) == []
    ada.shot("first-visit")
    ada.page.get_by_role("button", name="Measure and fit").click()
    expect(ada.page).to_have_url(re.compile("/pages/experiments/demo/results$"))
    expect(ada.page.get_by_role("heading", name="demo")).to_be_visible()
    ada.shot("first-result")


def test_the_rest_calls_are_listed_without_asking_another_host(laboratory_with, visitor) -> None:
    ada = visitor(
        laboratory_with(), "ada"
    )  # who looks at what leaves the host, and at errors of scripts and of the policy
    ada.page.goto(f"{ada.laboratory.address}/docs")
    page = ada.page
    page.get_by_label("Find a call").fill("get /rigs")
    expect(page.locator('[data-path="/users"]').first).to_be_hidden()
    call = page.locator('[data-method="GET"][data-path="/rigs/{rig}"]')
    call.locator("summary").press("Enter")
    call.get_by_label("rig (path").fill("bench")
    call.get_by_role("button", name="Send").press("Enter")
    expect(call.locator("[data-answer]")).to_contain_text("Joint 3 with something hidden")
    assert violations(page) == []


def test_an_admin_adds_a_user_whose_name_is_then_in_the_audit_log(laboratory_with, visitor) -> None:
    laboratory = laboratory_with()
    root = visitor(laboratory, "root")
    root.open("users")
    root.page.get_by_label("Name").fill("linus")
    root.page.get_by_label("Password").fill("another long password")
    root.page.get_by_role("button", name="Add", exact=True).click()
    expect(root.page.get_by_role("row", name=re.compile("linus"))).to_be_visible()
    root.shot("users")
    root.open("audit")
    expect(root.page.get_by_text("/pages/users").first).to_be_visible()
    root.shot("audit")


def test_a_token_is_shown_once_and_works_until_it_is_revoked(laboratory_with, visitor) -> None:
    import httpx

    laboratory = laboratory_with()
    ada = visitor(laboratory, "ada")
    ada.open("account")
    ada.page.get_by_label("Label").fill("notebook")
    ada.page.get_by_role("button", name="Make a token").click()
    secret = ada.page.locator(".secret").inner_text()
    headers = {"Authorization": f"Bearer {secret}"}
    assert httpx.get(f"{laboratory.address}/me", headers=headers).json()["name"] == "ada"
    ada.page.reload()
    expect(ada.page.locator(".secret")).to_have_count(0)
    ada.shot("account")
    ada.page.get_by_role("button", name="Revoke").click()
    expect(ada.page.get_by_text("No token yet")).to_be_visible()
    assert httpx.get(f"{laboratory.address}/me", headers=headers).status_code == 401


def test_the_theme_is_kept_and_nothing_flashes(laboratory_with, visitor) -> None:
    ada = visitor(laboratory_with(), "ada")
    ada.page.get_by_role("button", name="Theme").click()
    ada.page.get_by_role("button", name="Theme").click()
    expect(ada.page.locator("html")).to_have_attribute("data-theme", "dark")
    answer = ada.context.request.get(ada.page.url)
    assert 'data-theme="dark"' in answer.text()
