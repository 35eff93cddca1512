"""The audit log is complete and cannot be changed."""

import json
import sqlite3
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError
from typer.testing import CliRunner

from api.commands.audit import audit as audit_commands
from api.service.accounts import LOCAL_OPERATOR, Role
from api.service.audit import AuditLog
from api.service.database import Database

RIG = "rx130l-joint3-simulated"


def test_every_change_is_logged_with_who_what_and_outcome_and_no_reading_is(service):
    operator, admin = service.client(Role.OPERATOR), service.client(Role.ADMIN)
    operator.get("/rigs")
    operator.post(f"/rigs/{RIG}/take")
    operator.post("/users", json={"name": "eve", "password": "correct horse battery", "role": "admin"})
    log = admin.get("/audit").json()
    assert [(row["user"], row["action"], row["target"], row["outcome"]) for row in log] == [
        ("the-operator", "POST /users", "/users", "403"),
        ("the-operator", "POST /rigs/{rig}/take", f"/rigs/{RIG}/take", "200"),
    ]
    assert log[0]["client"] == "testclient"
    assert log[0]["time"] == service.clock.now


def test_a_failed_sign_in_is_logged_with_the_name_and_without_the_password(service):
    service.client().post("/sign-in", json={"name": "eve", "password": "guessed password"})
    row = service.client(Role.ADMIN).get("/audit").json()[0]
    assert row["outcome"] == "401"
    assert row["details"] == {"name": "eve"}
    assert "guessed" not in str(row)


def test_what_somebody_sent_writes_no_line_of_its_own_and_commands_no_terminal(service):
    operator, admin = service.client(Role.OPERATOR), service.client(Role.ADMIN)
    operator.post("/rigs/a%0aB%1b[2J%e2%80%ae/take")
    service.client().post("/sign-in", json={"name": "eve\n\x1b[2J", "password": "a wrong password"})
    sign_in, take = admin.get("/audit").json()
    assert sign_in["details"] == {"name": "eve \\x1b[2J"}
    assert "a B\\x1b[2J\\u202e" in take["target"]


@pytest.mark.parametrize("statement", ["UPDATE audit_log SET user = 'nobody'", "DELETE FROM audit_log"])
def test_the_database_itself_refuses_to_change_the_log(service, statement):
    service.client(Role.OPERATOR).post(f"/rigs/{RIG}/take")
    with pytest.raises(DBAPIError, match="append-only"), service.service.database.transaction() as session:
        session.execute(text(statement))
    assert len(service.service.audit.rows()) == 1


def test_the_log_is_read_page_by_page(service):
    operator, admin = service.client(Role.OPERATOR), service.client(Role.ADMIN)
    for _ in range(5):
        operator.post(f"/rigs/{RIG}/take")
    first = admin.get("/audit", params={"limit": 2}).json()
    second = admin.get("/audit", params={"limit": 2, "before": first[-1]["id"]}).json()
    assert [row["id"] for row in first + second] == [5, 4, 3, 2]


@pytest.fixture
def written(service):
    """A log of five rows, and what its check finds."""
    operator = service.client(Role.OPERATOR)
    for _ in range(5):
        operator.post(f"/rigs/{RIG}/take")
    return service.service


def behind_the_triggers(service, statement):
    """What whoever has the file can do."""
    with sqlite3.connect(service.settings.data_folder / "service.sqlite") as connection:
        for verb in ("update", "delete"):
            connection.execute(f"DROP TRIGGER IF EXISTS audit_log_no_{verb}")
        connection.execute(statement)


def test_an_untouched_log_holds_and_has_a_digest_to_note(written):
    found = written.audit.check()
    assert (found.rows, found.broken_at, found.ok) == (5, None, True)
    assert found.head == written.audit.rows(limit=1)[0].digest
    assert written.audit.check(noted=found.head).ok


@pytest.mark.parametrize(
    ("statement", "broken_at"),
    [
        ("UPDATE audit_log SET user = 'nobody' WHERE id = 3", 3),
        ("UPDATE audit_log SET outcome = '403' WHERE id = 1", 1),
        ("UPDATE audit_log SET details = '{\"a\": 1}' WHERE id = 5", 5),
        ("UPDATE audit_log SET time = time + 1 WHERE id = 2", 2),
        ("DELETE FROM audit_log WHERE id = 2", 3),
        ("DELETE FROM audit_log WHERE id = 1", 2),
        ("UPDATE audit_log SET id = 9 WHERE id = 2", 3),
    ],
)
def test_what_was_changed_behind_the_triggers_is_found(written, statement, broken_at):
    behind_the_triggers(written, statement)
    found = written.audit.check()
    assert (found.broken_at, found.ok) == (broken_at, False)


def test_a_log_that_was_cut_off_or_made_anew_is_found_by_a_digest_that_was_noted(written):
    noted = written.audit.check().head
    behind_the_triggers(written, "DELETE FROM audit_log WHERE id > 3")
    assert written.audit.check().ok
    assert written.audit.check(noted).noted is False
    assert not written.audit.check(noted).ok


def test_two_programs_that_write_at_the_same_time_make_one_chain(written):
    others = [Database(f"sqlite:///{written.settings.data_folder / 'service.sqlite'}") for _ in range(4)]
    together = threading.Barrier(4)

    def write(database):
        log = AuditLog(database, lambda: 1.5)
        together.wait()
        for number in range(10):
            log.append(LOCAL_OPERATOR, f"action {number}", "rig", "done")
        database.close()

    with ThreadPoolExecutor(4) as writing:
        list(writing.map(write, others))
    found = written.audit.check()
    assert (found.rows, found.broken_at) == (45, None)


def test_the_command_checks_the_log_and_says_where_it_was_changed(written):
    data = str(written.settings.data_folder)
    answer = CliRunner().invoke(audit_commands, ["verify", "--data", data, "--json"])
    assert answer.exit_code == 0
    found = json.loads(answer.stdout)
    assert found == {
        "rows": 5,
        "head": written.audit.check().head,
        "broken_at": None,
        "noted": None,
        "ok": True,
    }
    assert (
        CliRunner().invoke(audit_commands, ["verify", "--data", data, "--noted", found["head"]]).exit_code
        == 0
    )
    assert CliRunner().invoke(audit_commands, ["verify", "--data", data, "--noted", "0" * 64]).exit_code == 1
    behind_the_triggers(written, "UPDATE audit_log SET user = 'nobody' WHERE id = 3")
    answer = CliRunner().invoke(audit_commands, ["verify", "--data", data])
    assert answer.exit_code == 1
    assert "row 3" in answer.stdout
