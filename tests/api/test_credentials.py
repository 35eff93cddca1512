"""What guessing costs, which passwords and tokens there may be, and that somebody always manages people."""

import contextlib
import sqlite3
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from argon2 import PasswordHasher, extract_parameters
from sqlalchemy import event

from api.service.accounts import Accounts, Role
from api.service.database import open_database
from api.service.sign_in_throttle import CHECKED_TOGETHER, FREE_ATTEMPTS
from identify.recording.errors import InputError


@pytest.fixture
def ada(service):
    service.service.accounts.add_user("ada", "correct horse battery", Role.OPERATOR)
    return service


def test_attempts_at_the_same_time_are_no_cheaper_than_one_after_the_other(ada):
    together = threading.Barrier(40)

    def attempt(number):
        together.wait()
        answer = ada.client().post("/sign-in", json={"name": "ada", "password": f"wrong password {number}"})
        return answer.status_code

    with ThreadPoolExecutor(40) as attempting:
        answers = list(attempting.map(attempt, range(40)))
    assert answers.count(401) <= FREE_ATTEMPTS
    assert set(answers) <= {401, 429, 503}


def test_no_more_passwords_are_checked_at_the_same_time_than_may(ada, monkeypatch):
    """Forty people sign in at once; a check takes as long as all of them need to arrive."""
    at_once, most, counting, arrived = 0, 0, threading.Lock(), threading.Barrier(40)
    accounts = ada.service.accounts
    check = accounts.check_password

    def counted(name, password):
        nonlocal at_once, most
        with counting:
            at_once += 1
            most = max(most, at_once)
        try:
            return check(name, password)
        finally:
            with counting:
                at_once -= 1

    monkeypatch.setattr(accounts, "check_password", counted)

    def sign_in(number):
        arrived.wait()
        return ada.client().post("/sign-in", json={"name": f"user{number}", "password": "x"}).status_code

    with ThreadPoolExecutor(40) as signing_in:
        answers = set(signing_in.map(sign_in, range(40)))
    assert most <= CHECKED_TOGETHER
    assert answers <= {401, 429, 503}


@pytest.mark.parametrize(
    "password",
    ["aaaaaaaaaa", "1111111111", "abcdefghij", "qwertyuiop", "password123", "coulomb2026", "robotrobot"],
)
def test_a_password_that_is_guessed_first_is_refused_with_advice(ada, password):
    admin = ada.client(Role.ADMIN, "root")
    answer = admin.post("/users", json={"name": "eve", "password": password})
    assert answer.status_code == 422
    assert "easily guessed" in answer.json()["detail"]
    assert "words" in answer.json()["detail"]


@pytest.mark.parametrize("change", ["demote", "remove"])
def test_two_admins_cannot_take_each_others_place_away_to_none(ada, change):
    accounts = ada.service.accounts
    for round_ in range(10):
        pair = [f"first{round_}", f"second{round_}"]
        for name in pair:
            accounts.add_user(name, "correct horse battery", Role.ADMIN)
        others = [row.name for row in accounts.users() if row.role == Role.ADMIN and row.name not in pair]
        for name in others:
            accounts.remove_user(name)
        together = threading.Barrier(2)

        def lose(name, together=together):
            together.wait()
            try:
                accounts.change_user(name, role=Role.VIEWER) if change == "demote" else accounts.remove_user(
                    name
                )
            except InputError as error:
                assert "last admin" in str(error)  # noqa: PT017 - either of the two may be refused

        with ThreadPoolExecutor(2) as losing:
            list(losing.map(lose, pair))
        assert [row.role for row in accounts.users()].count(Role.ADMIN) == 1


@pytest.mark.parametrize("role", list(Role))
def test_a_token_makes_and_ends_no_tokens_and_changes_no_password(ada, role):
    token = ada.client(role, f"with-{role}")
    issued = ada.browser(f"with-{role}").post("/tokens", json={"label": "notebook"}).json()
    assert token.post("/tokens", json={"label": "another"}).status_code == 403
    assert token.delete(f"/tokens/{issued['id']}").status_code == 403
    change = {"old": "correct horse battery", "new": "staple battery horse"}
    assert token.put("/me/password", json=change).status_code == 403
    assert (
        token.post("/pages/account/tokens", data={"label": "x", "scope": "viewer", "days": "1"}).status_code
        == 403
    )
    assert token.post(f"/pages/account/tokens/{issued['id']}/revoke").status_code == 403


def test_nobody_else_reads_the_database(ada, data_folder):
    ada.browser("ada")
    files = list(data_folder.glob("service.sqlite*"))
    assert len(files) >= 2
    assert {file.stat().st_mode & 0o077 for file in files} == {0}


def test_a_database_that_others_could_read_is_closed_to_them(start_service, data_folder):
    data_folder.mkdir()
    (data_folder / "service.sqlite").touch(0o644)
    (data_folder / "service.sqlite").chmod(0o644)
    start_service()
    assert (data_folder / "service.sqlite").stat().st_mode & 0o777 == 0o600


@pytest.fixture
def accounts(tmp_path):
    database = open_database(tmp_path, None)
    yield Accounts(database, lambda: 1_800_000_000.0), database
    database.close()


def test_a_token_that_is_revoked_while_it_is_looked_up_lets_nobody_in(accounts, tmp_path):
    """Between the look and the note of its use: an error of ours before, now one more that is unknown."""
    known, database = accounts
    known.add_user("ada", "correct horse battery", Role.ADMIN)
    secret = known.issue_token("ada", "notebook", Role.ADMIN, 3600.0).secret

    def revoke(_connection, _cursor, statement, *_rest):
        if statement.startswith("SELECT") and "FROM users" in statement:
            with contextlib.closing(sqlite3.connect(tmp_path / "service.sqlite")) as other, other:
                other.execute("DELETE FROM tokens")

    event.listen(database.engine, "after_cursor_execute", revoke)
    assert known.user_of_token(secret) is None


def test_who_is_removed_while_signing_in_has_no_sign_in(accounts):
    known, _database = accounts
    known.add_user("ada", "correct horse battery", Role.VIEWER)
    ada = known.check_password("ada", "correct horse battery")
    known.remove_user("ada")
    with pytest.raises(InputError, match="there is no user ada"):
        known.open_sign_in(ada, 3600.0)


def test_what_a_password_let_in_ends_with_it_however_close_the_two_come(accounts):
    """Between the check of the old password and what it was checked for, somebody else changes it."""
    known, _database = accounts
    known.add_user("ada", "correct horse battery", Role.ADMIN)
    old = known.check_password("ada", "correct horse battery")
    sign_in = known.open_sign_in(old, 3600.0)
    known.change_user("ada", password="staple battery horse")
    with pytest.raises(InputError, match="was changed in the same moment"):
        known.open_sign_in(old, 3600.0)
    with pytest.raises(InputError, match="was changed in the same moment"):
        known.change_user("ada", password="horse of another colour", by=old)
    with pytest.raises(InputError, match="has ended"):
        known.issue_token("ada", "notebook", Role.ADMIN, 3600.0, sign_in=sign_in)
    assert known.let_in() == {}
    new = known.check_password("ada", "staple battery horse")
    assert known.issue_token("ada", "notebook", Role.ADMIN, 3600.0, sign_in=known.open_sign_in(new, 3600.0))


def test_whoever_signs_in_while_the_password_changes_is_told_to_sign_in_again(ada, monkeypatch):
    accounts = ada.service.accounts
    check = accounts.check_password

    def changed_meanwhile(name, password):
        checked = check(name, password)
        accounts.change_user(name, password="staple battery horse")
        return checked

    monkeypatch.setattr(accounts, "check_password", changed_meanwhile)
    client = ada.client()
    answer = client.post("/sign-in", json={"name": "ada", "password": "correct horse battery"})
    assert answer.status_code == 401
    assert "sign in again" in answer.json()["detail"]
    assert client.get("/me").status_code == 401


def test_an_unknown_name_costs_the_same_check_as_a_known_one(accounts):
    """The same work, from the first attempt on: one check with the same cost, and no hash made for the purpose."""
    known, _database = accounts
    known.add_user("ada", "correct horse battery", Role.VIEWER)
    checked = []

    class Noting(PasswordHasher):
        def verify(self, hash, password):
            checked.append(extract_parameters(hash))
            return super().verify(hash, password)

        def hash(self, *_arguments, **_named):
            pytest.fail("a hash was made while a password was checked")

    known._hasher = Noting()
    for name in ("ada", "eve", "No Name!"):
        assert known.check_password(name, "a wrong password") is None
    assert len(checked) == 3
    assert len({(each.type, each.memory_cost, each.time_cost, each.parallelism) for each in checked}) == 1
