"""A database that an earlier version wrote is brought forward when it is opened, and nothing in it is lost."""

import json
import sqlite3

import pytest
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError

from api.service.accounts import LOCAL_OPERATOR
from api.service.audit import AuditCheck, AuditLog
from api.service.database import Database, SessionRow
from api.service.migrations import NEWEST
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload

VERSION_1 = """
CREATE TABLE experiments (id VARCHAR(64) NOT NULL, name VARCHAR(255) NOT NULL, folder VARCHAR(1000) NOT NULL,
    joints JSON NOT NULL, payloads JSON NOT NULL, modified FLOAT NOT NULL, problem VARCHAR(1000),
    PRIMARY KEY (id), UNIQUE (folder));
CREATE TABLE sessions (experiment VARCHAR(64) NOT NULL, id VARCHAR(255) NOT NULL, file VARCHAR(300),
    payload JSON NOT NULL, role VARCHAR(20) NOT NULL, rig VARCHAR(64), "plan" VARCHAR(64),
    state VARCHAR(20) NOT NULL, reason VARCHAR(1000), created FLOAT NOT NULL, PRIMARY KEY (experiment, id),
    FOREIGN KEY(experiment) REFERENCES experiments (id) ON DELETE CASCADE);
CREATE TABLE audit_log (id INTEGER NOT NULL, time FLOAT NOT NULL, user VARCHAR(64) NOT NULL, role VARCHAR(16) NOT NULL,
    client VARCHAR(64) NOT NULL, action VARCHAR(200) NOT NULL, target VARCHAR(300) NOT NULL,
    outcome VARCHAR(300) NOT NULL, details JSON NOT NULL, PRIMARY KEY (id));
CREATE TRIGGER audit_log_no_update BEFORE UPDATE ON audit_log
    BEGIN SELECT RAISE(ABORT, 'the audit log is append-only'); END;
INSERT INTO audit_log VALUES (1, 1700000000.25, 'ada', 'operator', '', 'session start', 'rig', 'asked', '{"kg": 3.002}');
INSERT INTO audit_log VALUES (2, 1700000001.5, 'Zoë', 'admin', '', 'users add', 'eve', 'done', '{}');
INSERT INTO experiments VALUES ('arm', 'arm', 'arm', '["j3"]', '[]', 1.0, NULL);
"""
"""The tables as the version before the first migration made them."""


@pytest.fixture
def old(tmp_path):
    """A database of version 1 with a session that was weighed and one that was not."""
    file = tmp_path / "service.sqlite"
    connection = sqlite3.connect(file)
    connection.executescript(VERSION_1)
    for identifier, payload in (
        ("session-00", {"name": "disk", "mass": 3.0, "weighed": 3.002}),
        ("session-01", {"name": "none", "mass": 0.0}),
    ):
        connection.execute(
            "INSERT INTO sessions VALUES ('arm', ?, NULL, ?, 'identification', 'rig', 'plan', 'checked', NULL, 2.0)",
            (identifier, json.dumps(payload)),
        )
    connection.commit()
    connection.close()
    return file


def sessions(file):
    database = Database(f"sqlite:///{file}")
    with database.transaction() as session:
        rows = {row.id: row for row in session.query(SessionRow)}
    database.close()
    return rows


def test_the_weighed_mass_becomes_a_column_and_leaves_the_payload(old):
    rows = sessions(old)
    assert rows["session-00"].weighed == 3.002
    assert rows["session-00"].payload == Payload(name="disk", mass=3.0)
    assert rows["session-01"].weighed is None
    assert (rows["session-01"].state, rows["session-01"].rig) == ("checked", "rig")


def test_opening_again_changes_nothing_more(old):
    first = {key: (row.payload, row.weighed) for key, row in sessions(old).items()}
    assert {key: (row.payload, row.weighed) for key, row in sessions(old).items()} == first
    with sqlite3.connect(old) as connection:
        assert connection.execute("SELECT version FROM schema").fetchall() == [(NEWEST,)]


def test_a_step_that_fails_leaves_the_database_as_it_was(old):
    with sqlite3.connect(old) as connection:
        connection.execute("UPDATE sessions SET payload = '[' WHERE id = 'session-01'")
    with pytest.raises(ValueError, match="Expecting value"):
        Database(f"sqlite:///{old}")
    with sqlite3.connect(old) as connection:
        columns = [row[1] for row in connection.execute("PRAGMA table_info(sessions)")]
        tables = [row[0] for row in connection.execute("SELECT name FROM sqlite_master")]
    assert "weighed" not in columns
    assert "schema" not in tables


def test_a_new_database_has_the_newest_number_and_a_newer_one_is_refused(tmp_path):
    file = tmp_path / "new.sqlite"
    Database(f"sqlite:///{file}").close()
    with sqlite3.connect(file) as connection:
        assert connection.execute("SELECT version FROM schema").fetchall() == [(NEWEST,)]
        connection.execute("UPDATE schema SET version = 99")
    with pytest.raises(InputError, match="a newer version of coulomb wrote it"):
        Database(f"sqlite:///{file}")


def test_the_rows_of_the_audit_log_are_put_into_a_chain_that_goes_on(old):
    database = Database(f"sqlite:///{old}")
    log = AuditLog(database, lambda: 1_800_000_000.0)
    assert log.check() == AuditCheck(2, log.rows()[0].digest, None, None)
    log.append(LOCAL_OPERATOR, "session stop", "rig", "asked")
    assert (log.check().rows, log.check().broken_at) == (3, None)
    assert [row.user for row in log.rows()] == ["local operator", "Zoë", "ada"]
    with pytest.raises(DBAPIError, match="append-only"), database.transaction() as session:
        session.execute(text("UPDATE audit_log SET user = 'nobody'"))
    database.close()
