"""Signing in and out."""

from typing import Annotated

from fastapi import APIRouter, Request
from pydantic import BaseModel, Field

from api.service import access
from api.service.accounts import Role, User

router = APIRouter(tags=["accounts"])


class Credentials(BaseModel):
    """What a person types to sign in."""

    name: Annotated[str, Field(max_length=64, examples=["ada"])]
    password: Annotated[str, Field(max_length=1000, examples=["correct horse battery"])]


class Me(BaseModel):
    """Who asks, and what a page needs to go on."""

    name: str = Field(examples=["ada"])
    role: Role = Field(examples=[Role.OPERATOR])
    via: str = Field(examples=["cookie"])
    csrf_token: str | None = Field(examples=["8cJx0n4mWb2p"])


def _me(request: Request, user: User) -> Me:
    token = None if user.via == "token" else access.csrf_token(request)
    return Me(name=user.name, role=user.role, via=user.via, csrf_token=token)


@router.post("/sign-in", dependencies=[access.Public])
def sign_in(request: Request, credentials: Credentials) -> Me:
    """Sign a browser in: the response sets the cookie."""
    return _me(request, access.sign_in(request, credentials.name, credentials.password))


@router.post("/sign-out", status_code=204)
def sign_out(request: Request, _user: access.SignedIn) -> None:
    """End the browser's sign-in."""
    access.sign_out(request)


@router.get("/me")
def me(request: Request, user: access.SignedIn) -> Me:
    """Who asks."""
    return _me(request, user)
