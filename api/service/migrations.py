"""Databases of earlier versions, brought forward when they are opened.

The table `schema` holds one number. A database without it was written before there was one, which counts as 1. Each
migration leads to the next number; nothing leads back.
"""

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass

from sqlalchemy import Connection, column, inspect, select, table, text, update
from sqlalchemy.types import JSON, Float, String

from identify.recording.errors import InputError


@dataclass(frozen=True)
class Migration:
    """One step forward.

    version : the number that it leads to
    apply   : changes tables and moves what stands in them, within the transaction of the connection
    """

    version: int
    apply: Callable[[Connection], None]


def _weighed_mass_in_a_column(connection: Connection) -> None:
    """The mass that was weighed (kg) leaves the JSON of the payload."""
    connection.execute(text("ALTER TABLE sessions ADD COLUMN weighed FLOAT"))
    sessions = table(
        "sessions",
        column("experiment", String),
        column("id", String),
        column("payload", JSON),
        column("weighed", Float),
    )
    for row in connection.execute(select(sessions)).all():
        if "weighed" in row.payload:
            payload = {key: value for key, value in row.payload.items() if key != "weighed"}
            connection.execute(
                update(sessions)
                .where(sessions.c.experiment == row.experiment, sessions.c.id == row.id)
                .values(payload=payload, weighed=row.payload["weighed"])
            )


def _audit_rows_in_a_chain(connection: Connection) -> None:
    """Each row of the audit log carries a digest over itself and the row before; the tables' makers put the triggers back."""
    if not inspect(connection).has_table("audit_log"):
        return
    if connection.dialect.name == "sqlite":
        for verb in ("update", "delete"):
            connection.execute(text(f"DROP TRIGGER IF EXISTS audit_log_no_{verb}"))
    else:
        connection.execute(text("DROP TRIGGER IF EXISTS audit_log_append_only ON audit_log"))
    connection.execute(text("ALTER TABLE audit_log ADD COLUMN digest VARCHAR(64) NOT NULL DEFAULT ''"))
    content = ("time", "user", "role", "client", "action", "target", "outcome")
    log = table(
        "audit_log",
        column("id"),
        *(column(name) for name in content),
        column("details", JSON),
        column("digest", String),
    )
    before = ""
    for row in connection.execute(select(log).order_by(log.c.id)).all():
        values = [before, *(getattr(row, name) for name in content), row.details]
        # As audit.py has it; written out, for a migration stays as it was when audit.py goes on.
        packed = json.dumps(values, sort_keys=True, separators=(",", ":"))
        before = hashlib.sha256(packed.encode()).hexdigest()
        connection.execute(update(log).where(log.c.id == row.id).values(digest=before))


MIGRATIONS = (Migration(2, _weighed_mass_in_a_column), Migration(3, _audit_rows_in_a_chain))
NEWEST = MIGRATIONS[-1].version


def bring_forward(connection: Connection) -> None:
    """Apply what is missing to the database of `connection`; before its tables are created.

    Raises InputError where a newer version of the software wrote the database.
    """
    if _version(connection) == NEWEST:
        return
    if connection.dialect.name == "sqlite":
        # SQLite would otherwise lock at the first change, after another program has read the same old number.
        connection.execute(text("BEGIN IMMEDIATE"))
    version = _version(connection)
    if version is not None and version > NEWEST:
        raise InputError(
            f"database: a newer version of coulomb wrote it (its number is {version}, known here is {NEWEST}); "
            "use that version, or restore a copy from before"
        )
    for migration in MIGRATIONS:
        if version is not None and migration.version > version:
            migration.apply(connection)
    if version is None or not inspect(connection).has_table("schema"):
        connection.execute(text("CREATE TABLE schema (version INTEGER NOT NULL)"))
        connection.execute(text("INSERT INTO schema (version) VALUES (:version)"), {"version": NEWEST})
    else:
        connection.execute(text("UPDATE schema SET version = :version"), {"version": NEWEST})


def _version(connection: Connection) -> int | None:
    """The database's number; None where it is empty."""
    tables = inspect(connection)
    if tables.has_table("schema"):
        return connection.execute(text("SELECT version FROM schema")).scalar_one()
    return 1 if tables.has_table("sessions") else None
