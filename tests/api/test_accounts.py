"""Accounts: signing in and out, the cookie of a browser, tokens of scripts, passwords that are not stored."""

import json
from base64 import b64decode

import pytest

from api.service.accounts import Role
from api.service.sign_in_throttle import FREE_ATTEMPTS

PASSWORD = "correct horse battery"


@pytest.fixture
def ada(service):
    service.service.accounts.add_user("ada", PASSWORD, Role.OPERATOR)
    return service


def sign_in(service, name="ada", password=PASSWORD):
    return service.client().post("/sign-in", json={"name": name, "password": password})


def test_on_this_machine_without_accounts_a_local_operator_works_without_signing_in(service):
    assert service.client().get("/me").json()["role"] == "operator"
    assert service.client().get("/me").json()["name"] == "local operator"
    assert service.client().get("/users").status_code == 403


def test_once_there_is_an_account_everybody_signs_in(ada):
    answer = ada.client().get("/me")
    assert answer.status_code == 401
    assert answer.headers["WWW-Authenticate"] == "Bearer"
    assert ada.browser("ada").get("/me").json()["name"] == "ada"


def test_the_cookie_is_out_of_reach_of_scripts_and_other_sites_and_says_nothing_secret(ada):
    cookie = sign_in(ada).headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=lax" in cookie
    assert "secure" not in cookie  # plain http on this machine


def test_the_cookie_is_sent_by_https_only_where_browsers_come_by_https(start_service):
    service = start_service(secure_cookies=True)
    service.service.accounts.add_user("ada", PASSWORD, Role.VIEWER)
    assert "secure" in sign_in(service).headers["set-cookie"].lower()


def test_signing_out_ends_the_sign_in_even_for_a_copy_of_the_cookie(ada):
    browser = ada.browser("ada")
    copy = ada.client()
    copy.cookies = browser.cookies
    assert copy.get("/me").status_code == 200
    assert browser.post("/sign-out").status_code == 204
    assert copy.get("/me").status_code == 401


def test_a_sign_in_ends_by_itself_after_its_time(ada):
    browser = ada.browser("ada")
    ada.clock.advance(12 * 3600 - 1)
    assert browser.get("/me").status_code == 200
    ada.clock.advance(2)
    assert browser.get("/me").status_code == 401


def test_a_forged_cookie_signs_nobody_in(ada):
    browser = ada.browser("ada")
    value = browser.cookies["coulomb"]
    content = json.loads(b64decode(value.split(".")[0]))
    assert set(content) == {"sign_in", "csrf"}
    browser.cookies.clear()
    browser.cookies.set("coulomb", "A" + value[1:], domain="localhost.local")
    assert browser.get("/me").status_code == 401


def test_a_new_password_ends_all_sign_ins_and_tokens(ada):
    browser, other = ada.browser("ada"), ada.browser("ada")
    secret = browser.post("/tokens", json={"label": "notebook", "scope": "viewer"}).json()["secret"]
    new = {"old": PASSWORD, "new": "staple battery horse"}
    assert browser.put("/me/password", json=new | {"old": "wrong"}).status_code == 401
    assert browser.put("/me/password", json=new).status_code == 204
    assert other.get("/me").status_code == 401
    script = ada.client()
    script.headers["Authorization"] = f"Bearer {secret}"
    assert script.get("/me").status_code == 401
    assert sign_in(ada).status_code == 401
    assert sign_in(ada, password="staple battery horse").status_code == 200


def test_neither_passwords_nor_tokens_are_stored_readable(ada, data_folder):
    secret = ada.browser("ada").post("/tokens", json={"label": "notebook"}).json()["secret"]
    ada.service.database.close()
    stored = b"".join(file.read_bytes() for file in data_folder.glob("service.sqlite*"))
    assert secret.encode() not in stored
    assert PASSWORD.encode() not in stored
    assert b"$argon2id$" in stored


def test_an_expired_or_revoked_token_is_refused(ada):
    browser = ada.browser("ada")
    issued = browser.post("/tokens", json={"label": "notebook", "days": 1}).json()
    script = ada.client()
    script.headers["Authorization"] = f"Bearer {issued['secret']}"
    assert script.get("/me").status_code == 200
    ada.clock.advance(86401)
    assert script.get("/me").status_code == 401
    browser = ada.browser("ada")
    issued = browser.post("/tokens", json={"label": "notebook"}).json()
    script.headers["Authorization"] = f"Bearer {issued['secret']}"
    assert script.get("/me").status_code == 200
    assert browser.delete(f"/tokens/{issued['id']}").status_code == 204
    assert script.get("/me").status_code == 401


def test_somebody_elses_token_cannot_be_revoked(ada):
    issued = ada.browser("ada").post("/tokens", json={"label": "notebook"}).json()
    ada.client(Role.ADMIN, "root")
    assert ada.browser("root").delete(f"/tokens/{issued['id']}").status_code == 404


# --- throttling


def test_after_some_wrong_passwords_attempts_are_slowed_down_and_the_right_one_too(ada):
    for _ in range(FREE_ATTEMPTS):
        assert sign_in(ada, password="wrong password").status_code == 401
    answer = sign_in(ada)
    assert answer.status_code == 429
    assert answer.headers["Retry-After"] == "2"
    ada.clock.advance(2)
    assert sign_in(ada).status_code == 200
    # A success forgets the failures of that name.
    assert sign_in(ada, password="wrong password").status_code == 401
    assert sign_in(ada).status_code == 200


def test_an_unknown_name_is_answered_like_a_wrong_password(ada):
    unknown, wrong = sign_in(ada, "nobody", "wrong password"), sign_in(ada, password="wrong password")
    assert unknown.status_code == wrong.status_code == 401
    assert unknown.json()["detail"] == wrong.json()["detail"]
