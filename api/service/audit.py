"""The append-only log of every command that moved or changed something."""

from collections.abc import Callable

from sqlalchemy import select

from api.service.accounts import User
from api.service.database import AuditRow, Database
from identify.results.document import Json


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
    ) -> None:
        """Write one row and commit it.

        action  : what was asked, such as `POST /rigs/{rig}/stop` or `session start`
        target  : on what, such as `rig bench, experiment rx130l`
        outcome : what came of it, such as `asked`, `200` or `refused: rig is in use`
        client  : network address it came from
        """
        with self._database.transaction() as session:
            session.add(
                AuditRow(
                    time=self._clock(),
                    user=user.name,
                    role=user.role,
                    client=client[:64],
                    action=action[:200],
                    target=target[:300],
                    outcome=outcome[:300],
                    details=details or {},
                )
            )

    def rows(self, *, before: int | None = None, limit: int = 100) -> list[AuditRow]:
        """The newest rows first; `before` is the id to page on from."""
        query = select(AuditRow).order_by(AuditRow.id.desc()).limit(limit)
        if before is not None:
            query = query.where(AuditRow.id < before)
        with self._database.transaction() as session:
            return list(session.scalars(query))
