"""Who may stop, and what a stop means: whoever was let in since the service began, without asking a database."""

import pytest

from api.service.accounts import Role, User
from api.service.stop_requests import StopOrder
from tests.api.conftest import PASSWORD
from tests.api.rig_session import RIG, STEPS, operator, prepare, take, watch

__all__ = ["operator"]


@pytest.mark.parametrize(
    ("method", "path", "names"),
    [
        ("POST", "/pages/stop", {}),
        ("POST", "/rigs/bench/stop", {"rig": "bench"}),
        ("POST", "/rigs/be%20nch/stop", {"rig": "be nch"}),
        ("POST", "/experiments/arm/sessions/session-00/stop", {"experiment": "arm", "session": "session-00"}),
    ],
)
def test_a_stop_is_known_by_its_address(method, path, names):
    order = StopOrder.of(method, path)
    assert order is not None
    assert order.names == names


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/pages/stop"),
        ("POST", "/rigs/bench/stop/"),
        ("POST", "/rigs//stop"),
        ("POST", "/rigs/a/b/stop"),
        ("POST", "/rigs/bench/start"),
        ("POST", "//rigs/bench/stop"),
    ],
)
def test_nothing_else_is_a_stop(method, path):
    assert StopOrder.of(method, path) is None


@pytest.fixture
def moving(operator, service):
    """A session that runs."""
    prepare(operator)
    take(operator, "session-00", "weigh", *STEPS, mass=0.0)
    watch(operator, until=("running",))
    return operator


def test_a_token_that_was_revoked_stops_but_begins_nothing(moving, service):
    looker = service.client(Role.VIEWER, "grace")
    assert looker.get("/me").status_code == 200
    accounts = service.service.accounts
    (token,) = accounts.tokens("grace")
    assert accounts.revoke_token("grace", token.id)
    assert looker.get("/me").status_code == 401
    assert looker.post(f"/rigs/{RIG}/stop").json() == {"stopped": True}


def test_who_signed_in_or_has_a_token_stops_before_anything_else_was_asked(service):
    """The event loop may hang from the next moment on, and the database with it."""
    accounts, passes = service.service.accounts, service.service.stop_passes
    accounts.add_user("ada", PASSWORD, Role.OPERATOR)
    checked = accounts.check_password("ada", PASSWORD)
    assert passes.owner(accounts.open_sign_in(checked, 60.0)) == User("ada", Role.OPERATOR, "cookie")
    issued = accounts.issue_token("ada", "notebook", Role.VIEWER, 60.0)
    assert passes.owner(issued.secret) == User("ada", Role.VIEWER, "token")


def test_nobody_who_was_never_let_in_stops(moving, service):
    assert service.client().post(f"/rigs/{RIG}/stop").status_code == 401
    stranger = service.client()
    stranger.headers["Authorization"] = "Bearer coulomb_made-up"
    assert stranger.post(f"/rigs/{RIG}/stop").status_code == 401
    assert moving.post(f"/rigs/{RIG}/stop").json() == {"stopped": True}


def test_the_local_operator_still_stops_after_somebody_made_the_first_account(service):
    local = service.client()
    assert local.get("/me").json()["via"] == "local"
    service.service.accounts.add_user("ada", "correct horse battery", Role.ADMIN)
    assert local.get("/me").status_code == 401
    local.headers["Sec-Fetch-Site"] = "same-origin"
    assert local.post("/pages/stop").json()["stopped"] == []
    assert local.post("/experiments", json={"name": "arm", "rig": RIG}).status_code == 401


def test_a_foreign_page_stops_nothing(moving):
    for headers in ({"Origin": "http://evil.example"}, {"Sec-Fetch-Site": "cross-site"}):
        assert moving.post(f"/rigs/{RIG}/stop", headers=headers).status_code == 403
    assert moving.post(f"/rigs/{RIG}/stop").json() == {"stopped": True}


def test_an_old_page_still_stops_but_a_request_without_a_site_needs_its_token(service):
    service.service.accounts.add_user("ada", "correct horse battery", Role.VIEWER)
    browser = service.browser("ada")
    del browser.headers["X-CSRF-Token"]
    assert browser.post("/pages/stop").status_code == 403
    same_site = {"Origin": "http://localhost:8000", "Sec-Fetch-Site": "same-origin", "X-CSRF-Token": "old"}
    assert browser.post("/pages/stop", headers=same_site).status_code == 200


def test_a_stop_is_in_the_log_with_its_time_and_who_asked(moving, service, clock):
    moving.post(f"/rigs/{RIG}/stop")
    log = service.client(Role.ADMIN).get("/audit").json()
    (row,) = [row for row in log if row["action"] == "POST /rigs/{rig}/stop"]
    assert (row["user"], row["outcome"], row["target"]) == ("the-operator", "200", f"/rigs/{RIG}/stop")
    assert row["time"] == clock.now


def test_a_confirmation_belongs_to_who_starts(operator, service):
    prepare(operator)
    assert take(operator, "session-00", "weigh", "check", "confirm", mass=0.0).status_code == 200
    other = service.client(Role.OPERATOR, "grace")
    assert operator.post(f"/rigs/{RIG}/hand-over", json={"to": "grace"}).status_code == 200
    refused = take(other, "session-00", "arm")
    assert refused.status_code == 409
    assert "confirm" in refused.json()["detail"]
    assert take(other, "session-00", "confirm", "arm").status_code == 200
    # Handed back while armed: the first one's own confirmation has lapsed too.
    assert other.post(f"/rigs/{RIG}/hand-over", json={"to": "the-operator"}).status_code == 200
    assert take(operator, "session-00", "start").status_code == 409
    assert take(operator, "session-00", "confirm", "start").status_code == 200
    operator.post(f"/rigs/{RIG}/stop")
    watch(operator)


def test_an_alarm_stands_on_every_page_until_the_rig_was_checked_again(operator, service):
    prepare(operator)
    take(operator, "session-00", "check")
    assert operator.get("/pages/run-state").json()["alarms"] == []
    active = service.service.sessions.active(RIG)
    active.payload_session.alarm = "power could not be confirmed off: press the emergency stop"
    assert operator.get("/pages/run-state").json()["alarms"] == [f"{RIG}: {active.payload_session.alarm}"]
    assert operator.get(f"/rigs/{RIG}").json()["status"]["session"]["alarm"] == active.payload_session.alarm
