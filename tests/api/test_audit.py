"""The audit log is complete and cannot be changed."""

import pytest
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError

from api.service.accounts import Role

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
