"""The append-only log of every command that moved or changed something.

The database refuses to change or delete rows (triggers), and each row carries a SHA-256 over itself and the row before: who
gets round the triggers has to compute all later rows anew, which whoever noted a later digest elsewhere then sees.
"""

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass

from sqlalchemy import select

from api.service.accounts import User
from api.service.database import AuditRow, Database
from identify.recording.errors import one_line
from identify.results.document import Json

FIRST = ""
"""Digest before the first row."""
CHECKED_TOGETHER = 1000
"""Rows read at a time."""


@dataclass(frozen=True)
class AuditCheck:
    """What following the chain of digests found.

    rows      : checked, as far as the chain holds
    head      : digest of the last of them
    broken_at : id of the first row that does not follow from those before; None where all do
    noted     : whether the digest that was asked for is in the chain; None where none was asked for
    """

    rows: int
    head: str
    broken_at: int | None
    noted: bool | None

    @property
    def ok(self) -> bool:
        """Whether nothing was changed, and nothing removed up to the digest that was asked for."""
        return self.broken_at is None and self.noted is not False


def row_digest(before: str, row: AuditRow) -> str:
    """SHA-256, in hexadecimal, of a row and the digest of the row before."""
    content = [row.time, row.user, row.role, row.client, row.action, row.target, row.outcome, row.details]
    text = json.dumps([before, *content], sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


class AuditLog:
    """Appends rows; the database itself refuses to change or delete them (triggers)."""

    def __init__(self, database: Database, clock: Callable[[], float]) -> None:
        self._database = database
        self._clock = clock

    def append(
        self,
        user: User,
        action: str,
        target: str,
        outcome: str,
        *,
        client: str = "",
        details: Json | None = None,
        at: float | None = None,
    ) -> None:
        """Write one row and commit it. What is not shown, in texts that somebody sent, is written as its code.

        action  : what was asked, such as `POST /rigs/{rig}/stop` or `session start`
        target  : on what, such as `rig bench, experiment rx130l`
        outcome : what came of it, such as `asked`, `200` or `refused: rig is in use`
        client  : network address it came from
        at      : s since 1970, when it was; None is now
        """
        row = AuditRow(
            time=self._clock() if at is None else at,
            user=user.name,
            role=user.role,
            client=client[:64],
            action=one_line(action)[:200],
            target=one_line(target)[:300],
            outcome=one_line(outcome)[:300],
            details=_in_lines(details or {}),
        )
        with self._database.transaction(alone=True) as session:
            before = session.scalar(select(AuditRow.digest).order_by(AuditRow.id.desc()).limit(1))
            row.digest = row_digest(before or FIRST, row)
            session.add(row)

    def check(self, noted: str | None = None) -> AuditCheck:
        """Follow the chain from the first row.

        noted : a digest that was noted earlier; rows up to it cannot have been removed if it is in the chain
        """
        count, before, seen, last = 0, FIRST, noted == FIRST, 0
        while rows := self._rows_after(last):
            for row in rows:
                if row_digest(before, row) != row.digest:
                    return AuditCheck(count, before, row.id, None if noted is None else seen)
                count, before, last = count + 1, row.digest, row.id
                seen = seen or before == noted
        return AuditCheck(count, before, None, None if noted is None else seen)

    def _rows_after(self, identifier: int) -> list[AuditRow]:
        query = select(AuditRow).where(AuditRow.id > identifier).order_by(AuditRow.id).limit(CHECKED_TOGETHER)
        with self._database.transaction() as session:
            return list(session.scalars(query))

    def rows(self, *, before: int | None = None, limit: int = 100) -> list[AuditRow]:
        """The newest rows first; `before` is the id to page on from."""
        query = select(AuditRow).order_by(AuditRow.id.desc()).limit(limit)
        if before is not None:
            query = query.where(AuditRow.id < before)
        with self._database.transaction() as session:
            return list(session.scalars(query))


def _in_lines(details: Json) -> Json:
    return {name: one_line(value) if isinstance(value, str) else value for name, value in details.items()}
