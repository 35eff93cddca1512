"""The audit log."""

from typing import Annotated

from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, Field

from api.service import access
from identify.results.document import Json

router = APIRouter(tags=["audit"])


class AuditEntry(BaseModel):
    """One command that moved or changed something."""

    id: int = Field(examples=[412])
    time: float = Field(description="s since 1970", examples=[1795360000.0])
    user: str = Field(examples=["ada"])
    role: str = Field(examples=["operator"])
    client: str = Field(description="network address", examples=["192.0.2.7"])
    action: str = Field(examples=["session start"])
    target: str = Field(examples=["experiment rx130l-joint3, session-02"])
    outcome: str = Field(description="asked, an HTTP status, or a reason", examples=["asked"])
    details: Json = Field(examples=[{"payload": "disk"}])


@router.get("/audit")
def audit(
    request: Request,
    _user: access.Administrator,
    before: Annotated[int | None, Query(ge=1, le=2**53, description="entries older than this id")] = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> list[AuditEntry]:
    """The newest entries first. Nothing in the log can be changed or deleted."""
    access.service_of(request).stop_log.settle()
    rows = access.service_of(request).audit.rows(before=before, limit=limit)
    return [AuditEntry.model_validate(row, from_attributes=True) for row in rows]
