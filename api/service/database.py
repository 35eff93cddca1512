"""The service's tables: accounts, the audit log, jobs and an index of the experiment folders.

Experiment folders are the truth: the tables `experiments` and `sessions` can be dropped and rebuilt from them
(`coulomb reindex`). Times are seconds since 1970 as floats.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import (
    DDL,
    JSON,
    Dialect,
    Engine,
    ForeignKey,
    String,
    TypeDecorator,
    create_engine,
    event,
    text,
)
from sqlalchemy.engine import make_url
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import DeclarativeBase, Mapped, Session, mapped_column, sessionmaker

from api.service.migrations import bring_forward
from api.service.session_payload import SessionPayload, session_payload
from identify.recording.errors import InputError
from identify.recording.plain_text import LONGEST_NAME
from identify.results.document import Json

LONGEST_STATE, LONGEST_WORDS = 20, 1000
"""Letters of texts that come from files and people's programs; PostgreSQL refuses longer ones, so they are cut."""
BUSY_TIMEOUT = 10_000
"""ms that a SQLite writer waits for another: longer than any transaction here takes."""

POSTGRESQL_DRIVER = "postgresql+psycopg"
"""What `postgresql://` stands for: the driver that coulomb[postgresql] installs."""


class PayloadColumn(TypeDecorator[SessionPayload]):
    """A payload as JSON. Rows that an older version wrote are read as far as they say what a payload is."""

    impl = JSON
    cache_ok = True

    def process_bind_param(self, value: SessionPayload | None, dialect: Dialect) -> Json | None:
        """What is written."""
        return None if value is None else value.model_dump(mode="json")

    def process_result_value(self, value: object, dialect: Dialect) -> SessionPayload:
        """What was read."""
        return session_payload(value)


class Table(DeclarativeBase):
    """Base of all tables."""

    type_annotation_map = {Json: JSON, list[Any]: JSON}  # noqa: RUF012 - SQLAlchemy's own spelling


class UserRow(Table):
    """A person who may sign in."""

    __tablename__ = "users"
    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    role: Mapped[str] = mapped_column(String(16))
    password_hash: Mapped[str] = mapped_column(String(255))
    created: Mapped[float]


class SignInRow(Table):
    """A browser that is signed in; the id is stored as its SHA-256."""

    __tablename__ = "sign_ins"
    id_hash: Mapped[str] = mapped_column(String(64), primary_key=True)
    user: Mapped[str] = mapped_column(ForeignKey("users.name", ondelete="CASCADE"), index=True)
    expires: Mapped[float]


class TokenRow(Table):
    """A bearer token for REST; only its SHA-256 is stored."""

    __tablename__ = "tokens"
    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    user: Mapped[str] = mapped_column(ForeignKey("users.name", ondelete="CASCADE"), index=True)
    label: Mapped[str] = mapped_column(String(100))
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    scope: Mapped[str] = mapped_column(String(16))
    created: Mapped[float]
    expires: Mapped[float]
    last_used: Mapped[float | None]


class AuditRow(Table):
    """One command that moved or changed something; rows are never changed or deleted."""

    __tablename__ = "audit_log"
    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    time: Mapped[float] = mapped_column(index=True)
    user: Mapped[str] = mapped_column(String(64))
    role: Mapped[str] = mapped_column(String(16))
    client: Mapped[str] = mapped_column(String(64))
    action: Mapped[str] = mapped_column(String(200))
    target: Mapped[str] = mapped_column(String(300))
    outcome: Mapped[str] = mapped_column(String(300))
    details: Mapped[Json]
    digest: Mapped[str] = mapped_column(String(64))
    """SHA-256 over this row and the digest of the row before (audit.py)"""


class JobRow(Table):
    """A long computation, as last known; kept so that its id stays good after a restart."""

    __tablename__ = "jobs"
    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    kind: Mapped[str] = mapped_column(String(32))
    experiment: Mapped[str | None] = mapped_column(String(64), index=True)
    user: Mapped[str] = mapped_column(String(64))
    state: Mapped[str] = mapped_column(String(16))
    fraction: Mapped[float]
    words: Mapped[str] = mapped_column(String(LONGEST_WORDS))
    created: Mapped[float]
    ended: Mapped[float | None]
    result: Mapped[Json]


class ExperimentRow(Table):
    """Index of one experiment folder."""

    __tablename__ = "experiments"
    id: Mapped[str] = mapped_column(String(64), primary_key=True)
    name: Mapped[str] = mapped_column(String(LONGEST_NAME), index=True)
    folder: Mapped[str] = mapped_column(String(1000), unique=True)
    joints: Mapped[list[Any]]
    payloads: Mapped[list[Any]]
    modified: Mapped[float]
    problem: Mapped[str | None] = mapped_column(String(LONGEST_WORDS))


class SessionRow(Table):
    """Index of one payload session: measured (then the folder has its file) or still being prepared."""

    __tablename__ = "sessions"
    experiment: Mapped[str] = mapped_column(
        ForeignKey("experiments.id", ondelete="CASCADE"), primary_key=True
    )
    id: Mapped[str] = mapped_column(String(255), primary_key=True)
    file: Mapped[str | None] = mapped_column(String(300))
    payload: Mapped[SessionPayload] = mapped_column(PayloadColumn)
    weighed: Mapped[float | None]
    """kg, the payload as the scale said or the operator typed"""
    role: Mapped[str] = mapped_column(String(20))
    rig: Mapped[str | None] = mapped_column(String(64))
    plan: Mapped[str | None] = mapped_column(String(64))
    state: Mapped[str] = mapped_column(String(LONGEST_STATE))
    reason: Mapped[str | None] = mapped_column(String(LONGEST_WORDS))
    created: Mapped[float]


# Refusals by the database itself, so that no program that goes through it can rewrite the log.
_APPEND_ONLY = {
    "sqlite": [
        f"CREATE TRIGGER IF NOT EXISTS audit_log_no_{verb.lower()} BEFORE {verb} ON audit_log "
        "BEGIN SELECT RAISE(ABORT, 'the audit log is append-only'); END"
        for verb in ("UPDATE", "DELETE")
    ],
    "postgresql": [
        "CREATE OR REPLACE FUNCTION audit_log_append_only() RETURNS trigger AS "
        "$$ BEGIN RAISE EXCEPTION 'the audit log is append-only'; END $$ LANGUAGE plpgsql",
        "CREATE OR REPLACE TRIGGER audit_log_append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON audit_log "
        "FOR EACH STATEMENT EXECUTE FUNCTION audit_log_append_only()",
    ],
}


_ALONE = {"sqlite": "BEGIN IMMEDIATE", "postgresql": "SELECT pg_advisory_xact_lock(4077002)"}
"""What makes a transaction wait for others of its kind before it reads; the number is ours."""
_ONE_AT_A_TIME = "SELECT pg_advisory_xact_lock(4077001)"
"""Two programs that begin together must not create the same tables: the second waits for the first. The number is ours."""


class Database:
    """The engine and its sessions.

    url : SQLAlchemy address; SQLite and PostgreSQL can refuse changes of the audit log, others are turned
    down.

    Raises InputError if the address is not understood, its driver is missing, its kind is not supported, or a newer version
    of the software wrote it.
    """

    def __init__(self, url: str) -> None:
        try:
            address = make_url(url)
        except Exception as error:
            raise InputError(f"database address is not usable: {error}") from error
        kind = address.get_backend_name()
        if kind not in _APPEND_ONLY:
            raise InputError(f"database address: {kind} is not supported; use sqlite or postgresql")
        if address.drivername == "postgresql":
            address = address.set(drivername=POSTGRESQL_DRIVER)
        try:
            # A connection that the server closed meanwhile (a restart) is noticed and opened anew.
            self.engine: Engine = create_engine(address, pool_pre_ping=kind != "sqlite")
        except ModuleNotFoundError as error:
            needed = "; install coulomb[postgresql]" if kind == "postgresql" else ""
            raise InputError(f"database address: its driver {error.name} is not installed{needed}") from error
        except Exception as error:
            raise InputError(f"database address is not usable: {error}") from error
        self._alone = _ALONE[kind]
        if kind == "sqlite":
            if address.database and address.database != ":memory:":
                _keep_to_ourselves(Path(address.database))
            event.listen(self.engine, "connect", _prepare_sqlite)
        self._sessions = sessionmaker(self.engine, expire_on_commit=False)
        try:
            with self.engine.begin() as connection:
                if kind == "postgresql":
                    connection.execute(DDL(_ONE_AT_A_TIME))
                bring_forward(connection)
                Table.metadata.create_all(connection)
                for statement in _APPEND_ONLY[kind]:
                    connection.execute(DDL(statement))
        except DBAPIError as error:
            reason = " ".join(str(error.orig).split())
            raise InputError(f"database {address!r}: {reason}") from error

    @contextmanager
    def transaction(self, *, alone: bool = False) -> Iterator[Session]:
        """A session that commits at the end and rolls back on an exception.

        alone : no other transaction that says so runs meanwhile, in whatever process: what is read here still holds when it
                is written
        """
        with self._sessions.begin() as session:
            if alone:
                session.execute(text(self._alone))
            yield session

    def close(self) -> None:
        """Give back all connections."""
        self.engine.dispose()


def open_database(data_folder: Path, url: str | None) -> Database:
    """The database at `url`, or SQLite in the data folder, which is made if need be.

    Raises InputError if the folder or the database cannot be used.
    """
    try:
        data_folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"data folder {data_folder}: {error.strerror}") from error
    return Database(url or f"sqlite:///{data_folder / 'service.sqlite'}")


def _keep_to_ourselves(file: Path) -> None:
    """Let nobody else read password hashes and the log; SQLite's companions of the file take its permissions on.

    Raises InputError where that cannot be.
    """
    try:
        os.close(os.open(file, os.O_RDWR | os.O_CREAT, 0o600))
        for each in (file, file.with_name(f"{file.name}-wal"), file.with_name(f"{file.name}-shm")):
            if each.exists() and each.stat().st_mode & 0o077:
                each.chmod(0o600)
    except OSError as error:
        raise InputError(f"database {file}: {error.strerror}") from error


def _prepare_sqlite(connection: Any, _record: Any) -> None:
    cursor = connection.cursor()
    cursor.execute("PRAGMA journal_mode=WAL")
    cursor.execute(f"PRAGMA busy_timeout={BUSY_TIMEOUT}")
    cursor.execute("PRAGMA foreign_keys=ON")
    cursor.execute("PRAGMA synchronous=FULL")
    cursor.close()
