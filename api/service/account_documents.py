"""Who asks, and what they may, as a document."""

from enum import StrEnum

from pydantic import BaseModel, Field


class Role(StrEnum):
    """What a person may do: look; run experiments and change models; manage people too."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    ADMIN = "admin"

    def covers(self, needed: "Role") -> bool:
        """True if whoever has this role may do what `needed` may."""
        order = list(Role)
        return order.index(self) >= order.index(needed)


class Me(BaseModel):
    """Who asks, and what a page needs to go on."""

    name: str = Field(examples=["ada"])
    role: Role = Field(examples=[Role.OPERATOR])
    via: str = Field(description="cookie, token or local", examples=["cookie"])
    csrf_token: str | None = Field(
        description="to be sent as X-CSRF-Token with every change; null with a bearer token",
        examples=["8cJx0n4mWb2p"],
    )
