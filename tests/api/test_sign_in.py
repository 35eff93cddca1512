"""Signing in, the browser's cookie, CSRF, other sites, throttling."""

import json
from base64 import b64decode

import pytest
from hypothesis import given
from hypothesis import strategies as st

from api.application import create_application
from api.service.accounts import Role
from api.service.problems import Problem
from api.service.settings import ServiceSettings, is_loopback
from api.service.sign_in_throttle import FREE_ATTEMPTS, LONGEST_WAIT, REMEMBERED, SignInThrottle
from identify.recording.errors import InputError

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


# --- CSRF and other sites


@pytest.mark.parametrize("header", [None, "wrong"])
def test_a_change_without_the_pages_token_is_refused(ada, header):
    browser = ada.browser("ada")
    del browser.headers["X-CSRF-Token"]
    headers = {} if header is None else {"X-CSRF-Token": header}
    answer = browser.post("/rigs/rx130l-joint3-simulated/take", headers=headers)
    assert answer.status_code == 403
    assert "load the page again" in answer.json()["detail"]


def test_a_page_of_another_site_changes_nothing_even_for_the_local_operator(service):
    client = service.client()
    for headers in (
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ):
        assert client.post("/rigs/rx130l-joint3-simulated/take", headers=headers).status_code == 403
    ours = {"Origin": "http://localhost:8000", "Sec-Fetch-Site": "same-origin"}
    assert client.post("/rigs/rx130l-joint3-simulated/take", headers=ours).status_code == 200


def test_a_page_of_another_site_cannot_look_on_over_a_websocket(service):
    from starlette.websockets import WebSocketDisconnect

    address = "ws://localhost:8000/rigs/rx130l-joint3-simulated/live"
    with (
        pytest.raises(WebSocketDisconnect) as refused,
        service.client().websocket_connect(address, headers={"Origin": "http://evil.example"}),
    ):
        pass
    assert refused.value.code == 1008


def test_a_foreign_name_that_resolves_to_this_machine_is_refused(service, start_service):
    answer = service.client().get("/me", headers={"Host": "evil.example"})
    assert answer.status_code == 400
    assert "--allow-host evil.example" in answer.json()["detail"]
    for host in ("localhost:9", "127.0.0.1", "[::1]:8000"):
        assert service.client().get("/me", headers={"Host": host}).status_code == 200
    allowed = start_service(allowed_hosts=("lab.example",))
    assert allowed.client().get("/me", headers={"Host": "lab.example:8000"}).status_code == 200


def test_every_response_forbids_framing_sniffing_and_foreign_scripts(service):
    headers = service.client().get("/me").headers
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert "default-src 'self'" in headers["Content-Security-Policy"]


# --- reaching beyond this machine


@pytest.mark.parametrize("host", ["0.0.0.0", "192.0.2.1", "::", "lab.example"])
def test_without_accounts_the_service_refuses_to_listen_beyond_this_machine(data_folder, host):
    settings = ServiceSettings(data_folder=data_folder, host=host)
    with pytest.raises(InputError, match="coulomb users add NAME --role admin"):
        create_application(settings)


def test_beyond_this_machine_there_is_no_local_operator(start_service, data_folder, clock):
    first = start_service()
    first.service.accounts.add_user("ada", PASSWORD, Role.ADMIN)
    beyond = start_service(host="0.0.0.0")
    assert beyond.client().get("/me").status_code == 401


@pytest.mark.parametrize(
    ("host", "loopback"),
    [
        ("localhost", True),
        ("127.0.0.1", True),
        ("127.8.9.1", True),
        ("::1", True),
        ("0.0.0.0", False),
        ("a.b", False),
    ],
)
def test_addresses_of_this_machine_are_told_from_others(host, loopback):
    assert is_loopback(host) is loopback


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


class _Clock:
    now = 0.0

    def __call__(self):
        return self.now


def seconds_to_wait(throttle, name, address):
    """Make an attempt with a wrong password; 0 if its password was looked at."""
    try:
        with throttle.attempt(name, address):
            return 0
    except Problem as problem:
        return int(problem.headers["Retry-After"])


@given(attempts=st.integers(1, 60))
def test_the_wait_doubles_up_to_its_longest_and_a_day_holds_few_guesses(attempts):
    clock = _Clock()
    throttle = SignInThrottle(clock)
    waits = []
    for _ in range(attempts):
        wait = seconds_to_wait(throttle, "ada", "192.0.2.1")
        waits.append(wait)
        clock.now += wait
        if wait:
            assert seconds_to_wait(throttle, "ada", "192.0.2.1") == 0
    assert waits == [
        min(2 ** max(0, n - FREE_ATTEMPTS + 1), LONGEST_WAIT) * (n >= FREE_ATTEMPTS) for n in range(attempts)
    ]


def test_guessing_from_one_address_does_not_lock_out_the_owner_at_another():
    throttle = SignInThrottle(_Clock())
    for _ in range(50):
        seconds_to_wait(throttle, "ada", "192.0.2.1")
    assert seconds_to_wait(throttle, "ada", "192.0.2.1") > 0
    assert seconds_to_wait(throttle, "ada", "192.0.2.2") == 0


def test_trying_many_names_from_one_address_is_slowed_down():
    throttle = SignInThrottle(_Clock())
    for number in range(4 * FREE_ATTEMPTS):
        assert seconds_to_wait(throttle, f"user{number}", "192.0.2.1") == 0
    assert seconds_to_wait(throttle, "another", "192.0.2.1") > 0


def test_made_up_names_do_not_fill_the_memory():
    throttle = SignInThrottle(_Clock())
    for number in range(REMEMBERED):
        seconds_to_wait(throttle, f"user{number}", f"192.0.2.{number}")
    assert len(throttle._failures) <= REMEMBERED


def test_addresses_that_one_computer_chooses_among_count_as_one():
    throttle = SignInThrottle(_Clock())
    for number in range(4 * FREE_ATTEMPTS):
        seconds_to_wait(throttle, f"user{number}", f"2001:db8::{number:x}")
    assert seconds_to_wait(throttle, "another", "2001:db8::ffff") > 0
    assert seconds_to_wait(throttle, "another", "2001:db8:0:1::1") == 0
