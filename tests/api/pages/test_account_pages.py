"""Sign-in, tokens, users and the audit log, as forms send them and pages show them."""

import re

import pytest

from api.pages.account_pages import AUDIT_ROWS
from api.service.accounts import Role, User
from tests.api.conftest import PASSWORD

HTML = {"Accept": "text/html"}


def options(text: str) -> list[str]:
    return re.findall(r"<option[^>]*>([^<]+)</option>", text)


def test_a_sign_in_leads_to_the_page_asked_for_and_never_to_another_host(service):
    service.service.accounts.add_user("ada", PASSWORD, Role.VIEWER)
    for then, led_to in (
        ("/pages/rig?rig=bench", "/pages/rig?rig=bench"),
        ("", "/pages/"),
        ("/docs", "/pages/"),
        ("/pages.elsewhere.example/", "/pages/"),
        ("//elsewhere.example/pages/", "/pages/"),
        ("/pages//elsewhere.example", "/pages/"),
    ):
        form = {"name": " ada ", "password": PASSWORD, "then": then}
        answer = service.client().post("/pages/sign-in", data=form)
        assert (answer.status_code, answer.headers["hx-redirect"]) == (204, led_to)


def test_a_wrong_password_stays_at_the_form(service):
    service.service.accounts.add_user("ada", PASSWORD, Role.VIEWER)
    answer = service.client().post("/pages/sign-in", data={"name": "ada", "password": "wrong"})
    assert answer.status_code == 403
    assert "hx-redirect" not in answer.headers


def test_the_form_says_how_the_first_account_is_made_and_that_a_sign_in_has_ended(service):
    stranger = service.client()
    assert "users add NAME --role admin" in stranger.get("/pages/sign-in").text
    service.service.accounts.add_user("ada", PASSWORD, Role.VIEWER)
    text = stranger.get("/pages/sign-in", params={"then": "/pages/rig"}).text
    assert 'name="then" value="/pages/rig"' in text
    assert "users add" not in text
    assert "has ended" not in text
    assert "has ended" in stranger.get("/pages/sign-in", params={"ended": True}).text


def test_a_token_has_no_more_rights_than_its_owner_and_lasts_the_days_asked_for(service, clock):
    accounts = service.service.accounts
    accounts.add_user("ada", PASSWORD, Role.OPERATOR)
    ada = service.browser("ada")
    assert options(ada.get("/pages/account", headers=HTML).text) == ["viewer", "operator"]
    asked = {"label": "notebook", "scope": "viewer", "days": 2}
    shown = ada.post("/pages/account/tokens", data=asked)
    assert shown.status_code == 200
    (token,) = accounts.tokens("ada")
    assert (token.label, token.scope) == ("notebook", Role.VIEWER)
    assert token.expires == pytest.approx(clock.now + 2 * 86400.0)
    assert re.search(r'class="secret">[^<]{20,}<', shown.text)
    for wrong in ({"days": 0}, {"days": 366.5}, {"label": ""}, {"scope": "admin"}):
        assert ada.post("/pages/account/tokens", data=asked | wrong).status_code in (400, 403, 422)
    assert len(accounts.tokens("ada")) == 1
    revoke = f"/pages/account/tokens/{token.id}/revoke"
    assert ada.post(revoke).headers["hx-refresh"] == "true"
    assert accounts.tokens("ada") == []
    assert ada.post(revoke).status_code == 404


def test_a_new_password_needs_the_old_one_and_ends_the_sign_in(service):
    service.service.accounts.add_user("ada", PASSWORD, Role.VIEWER)
    ada = service.browser("ada")
    change = "/pages/account/password"
    new = "another horse battery"
    assert ada.post(change, data={"old": "wrong", "new": new}).status_code in (401, 403)
    assert ada.post(change, data={"old": PASSWORD, "new": "short"}).status_code in (400, 422)
    answer = ada.post(change, data={"old": PASSWORD, "new": new})
    assert (answer.status_code, answer.headers["hx-redirect"]) == (204, "/pages/sign-in")
    assert ada.get("/account/tokens").status_code in (401, 404)
    assert service.browser("ada", new).get("/pages/account", headers=HTML).status_code == 200


def test_users_are_added_changed_and_removed_by_their_forms(service):
    admin, accounts = service.client(Role.ADMIN), service.service.accounts
    new = {"name": " ada ", "password": PASSWORD, "role": "viewer"}
    assert admin.post("/pages/users", data=new).headers["hx-refresh"] == "true"
    assert admin.post("/pages/users", data=new | {"name": "bob", "password": "short"}).status_code == 422
    text = admin.get("/pages/users", headers=HTML).text
    assert '<select name="role" aria-label="Role of ada"><option selected>viewer</option>' in text
    assert admin.post("/pages/users/ada/role", data={"role": "operator"}).headers["hx-refresh"] == "true"
    assert {row.name: row.role for row in accounts.users()} == {"the-admin": "admin", "ada": "operator"}
    assert admin.post("/pages/users/ada/remove").headers["hx-refresh"] == "true"
    assert [row.name for row in accounts.users()] == ["the-admin"]


def test_the_log_shows_a_hundred_rows_the_newest_first_and_leads_to_the_older_ones(service):
    admin, audit = service.client(Role.ADMIN), service.service.audit
    ada = User("ada", Role.OPERATOR, "token")
    for number in range(AUDIT_ROWS):
        audit.append(ada, f"step {number}", "bench", "200")
    actions = re.compile(r'data-label="what">([^<]+)<')
    text = admin.get("/pages/audit", headers=HTML).text
    assert actions.findall(text) == [f"step {number}" for number in reversed(range(100))]
    older = re.search(r'href="(/pages/audit\?before=\d+)"', text)
    assert actions.findall(admin.get(older[1], headers=HTML).text) == []
    audit.append(ada, "one more", "bench", "200")
    text = admin.get("/pages/audit", headers=HTML).text
    assert actions.findall(text)[0] == "one more"
    last = admin.get(re.search(r'href="(/pages/audit\?before=\d+)"', text)[1], headers=HTML).text
    assert actions.findall(last) == ["step 0"]
    assert "/pages/audit?before=" not in last


def test_what_was_refused_stands_out_in_the_log(service):
    admin = service.client(Role.ADMIN)
    for outcome in ("200", "303", "asked", "done", "404", "500", "refused: rig is in use"):
        service.service.audit.append(User("ada", Role.OPERATOR, "token"), "session start", "bench", outcome)
    text = admin.get("/pages/audit", headers=HTML).text
    assert re.findall(r'class="state warn">([^<]+)<', text) == ["refused: rig is in use", "500", "404"]
