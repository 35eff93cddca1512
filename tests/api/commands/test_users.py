"""`coulomb users`: what is written into the accounts and the audit log, and what is refused."""

import io
import json

import pytest

from api.service.accounts import Role
from api.service.open_data import open_data

PASSWORD = "correct horse battery"


@pytest.fixture
def users(coulomb_here):
    """`coulomb users …`, the lines that it prints."""

    def run(*arguments, given=PASSWORD + "\n") -> list[str]:
        answer = coulomb_here("users", *arguments, given=given)
        assert (answer.returncode, answer.stderr) == (0, "")
        return answer.stdout.splitlines()

    return run


@pytest.fixture
def opened(data_folder):
    """The data folder, as the service would open it."""
    return lambda: open_data(data_folder, None)


def test_a_user_is_added_listed_changed_and_removed_and_each_change_is_noted(users, opened):
    assert users("add", "ada") == ["ada may sign in as viewer"]
    assert users("add", "bob", "--role", "operator", given=PASSWORD + "\r\n") == [
        "bob may sign in as operator"
    ]
    assert users("list") == ["ada" + 22 * " " + "viewer", "bob" + 22 * " " + "operator"]
    users("change", "ada", "--role", "admin")
    assert json.loads("".join(users("list", "--json"))) == [
        {"name": "ada", "role": "admin"},
        {"name": "bob", "role": "operator"},
    ]
    users("change", "bob", "--password", given="another horse battery\n")
    with opened() as data:
        assert data.accounts.check_password("bob", PASSWORD) is None
        assert data.accounts.check_password("bob", "another horse battery").user.role is Role.OPERATOR
        assert data.accounts.check_password("ada", PASSWORD).user.role is Role.ADMIN
    assert users("remove", "bob") == ["bob is removed"]
    with opened() as data:
        assert [row.name for row in data.accounts.users()] == ["ada"]
        noted = [(row.action, row.target, row.details) for row in data.audit.rows()]
    assert noted[::-1] == [
        ("users add", "ada", {"role": "viewer"}),
        ("users add", "bob", {"role": "operator"}),
        ("users change", "ada", {"role": "admin", "password": False}),
        ("users change", "bob", {"role": None, "password": True}),
        ("users remove", "bob", {}),
    ]


def test_a_token_lasts_as_many_days_as_asked_and_has_no_more_than_was_asked(users, opened):
    users("add", "ada", "--role", "admin")
    (plain,) = users("token", "ada")
    (other,) = users("token", "ada", "--scope", "operator", "--days", "0.5", "--label", "nightly")
    with opened() as data:
        first, second = data.accounts.tokens("ada")
        assert data.accounts.user_of_token(plain).role is Role.VIEWER
        assert data.accounts.user_of_token(other).role is Role.OPERATOR
    assert (first.label, first.expires - first.created) == ("command line", pytest.approx(30 * 24 * 3600))
    assert (second.label, second.expires - second.created) == ("nightly", pytest.approx(12 * 3600))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["token", "ada", "--days", "0"], "token: it lasts between 0 and 366 days"),
        (["token", "ada", "--scope", "operator"], "token: scope operator exceeds the role viewer of ada"),
        (["change", "ada"], "users change: give --role ROLE, --password, or both"),
        (["change", "ada", "--role", "chief"], "role: 'chief' is not one of viewer, operator, admin"),
    ],
)
def test_what_is_refused_is_said_in_a_line_and_changes_nothing(users, coulomb_here, opened, arguments, words):
    users("add", "ada")
    answer = coulomb_here("users", *arguments)
    assert (answer.returncode, answer.stderr) == (2, f"coulomb: {words}\n")
    with opened() as data:
        assert data.accounts.tokens("ada") == []
        assert [row.role for row in data.accounts.users()] == ["viewer"]
        assert len(data.audit.rows()) == 1


class Terminal(io.StringIO):
    """A person types."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("second", "status"), [("one horse battery", 0), ("two horse battery", 2)])
def test_a_person_types_a_password_twice_alike(coulomb_here, opened, monkeypatch, second, status):
    typed = iter(["one horse battery", second])
    monkeypatch.setattr("getpass.getpass", lambda prompt: next(typed))
    monkeypatch.setattr("io.StringIO", Terminal)
    answer = coulomb_here("users", "add", "ada")
    assert answer.returncode == status
    assert ("password: the two are not the same" in answer.stderr) is (status == 2)
    with opened() as data:
        assert [row.name for row in data.accounts.users()] == ([] if status else ["ada"])
