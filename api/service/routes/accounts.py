"""Signing in and out, users, bearer tokens."""

from typing import Annotated

from fastapi import APIRouter, Path, Request
from pydantic import BaseModel, Field

from api.service import access, text_forms
from api.service.account_documents import Me
from api.service.accounts import Role, User
from api.service.openapi import ResourceRoute, problems
from api.service.problems import Problem, not_found
from api.service.request_document import RequestDocument
from identify.recording.errors import InputError

router = APIRouter(tags=["accounts"], route_class=ResourceRoute)

UserName = Annotated[str, Path(pattern=text_forms.USER_NAME)]
Password = Annotated[str, Field(min_length=10, max_length=1000, examples=["correct horse battery"])]


class Credentials(RequestDocument):
    """What a person types to sign in."""

    name: Annotated[str, Field(max_length=64, examples=["ada"])]
    password: Annotated[str, Field(max_length=1000, examples=["correct horse battery"])]


class UserSummary(BaseModel):
    """A person who may sign in."""

    name: str = Field(examples=["ada"])
    role: Role = Field(examples=[Role.OPERATOR])
    created: float = Field(description="s since 1970", examples=[1795360000.0])


class NewUser(RequestDocument):
    """A user to be created."""

    name: Annotated[str, Field(pattern=text_forms.USER_NAME, examples=["grace"])]
    password: Password
    role: Role = Field(default=Role.VIEWER, examples=[Role.OPERATOR])


class UserChange(RequestDocument):
    """What changes of a user; what is left out stays."""

    role: Role | None = Field(default=None, examples=[Role.ADMIN])
    password: Password | None = None


class OwnPassword(RequestDocument):
    """One's own password, old and new."""

    old: Annotated[str, Field(max_length=1000, examples=["correct horse battery"])]
    new: Annotated[str, Field(min_length=10, max_length=1000, examples=["staple battery horse"])]


class TokenRequest(RequestDocument):
    """A bearer token to be made; its scope is at most one's own role."""

    label: Annotated[str, Field(min_length=1, max_length=100, examples=["notebook"])]
    scope: Role = Field(default=Role.VIEWER, examples=[Role.VIEWER])
    days: Annotated[float, Field(gt=0, le=366, examples=[30])] = 30


class TokenSummary(BaseModel):
    """A bearer token without its secret."""

    id: str = Field(examples=["1d2c3b4a59687706"])
    label: str = Field(examples=["notebook"])
    scope: Role = Field(examples=[Role.VIEWER])
    created: float = Field(description="s since 1970", examples=[1795360000.0])
    expires: float = Field(description="s since 1970", examples=[1797952000.0])
    last_used: float | None = Field(default=None, description="s since 1970", examples=[1795363600.0])


class NewToken(TokenSummary):
    """A bearer token just made."""

    secret: str = Field(description="shown this once", examples=["coulomb_Qm9…"])


def _me(request: Request, user: User) -> Me:
    token = None if user.via == "token" else access.csrf_token(request)
    return Me(name=user.name, role=user.role, via=user.via, csrf_token=token)


@router.post("/sign-in", dependencies=[access.Public], responses=problems(401, 429, 503))
def sign_in(request: Request, credentials: Credentials) -> Me:
    """Sign a browser in: the response sets the cookie. Attempts are throttled by name and address."""
    return _me(request, access.sign_in(request, credentials.name, credentials.password))


@router.post("/sign-out", status_code=204)
def sign_out(request: Request, _user: access.SignedIn) -> None:
    """End the browser's sign-in."""
    access.sign_out(request)


@router.get("/me")
def me(request: Request, user: access.SignedIn) -> Me:
    """Who asks."""
    return _me(request, user)


@router.put("/me/password", status_code=204, responses=problems(429, 503))
def change_own_password(request: Request, user: access.Person, passwords: OwnPassword) -> None:
    """Change one's own password; all browsers sign in again and all tokens are void."""
    checked = access.verify_password(request, user.name, passwords.old)
    access.service_of(request).accounts.change_user(user.name, password=passwords.new, by=checked)


@router.get("/users")
def list_users(request: Request, _user: access.Administrator) -> list[UserSummary]:
    """Everybody who may sign in."""
    rows = access.service_of(request).accounts.users()
    return [UserSummary(name=row.name, role=Role(row.role), created=row.created) for row in rows]


@router.post("/users", status_code=201, responses=problems(409))
def add_user(request: Request, _user: access.Administrator, new: NewUser) -> UserSummary:
    """Create a user."""
    accounts = access.service_of(request).accounts
    if any(row.name == new.name for row in accounts.users()):
        raise Problem(409, f"The user {new.name} exists already.")
    accounts.add_user(new.name, new.password, new.role)
    return _summary(request, new.name)


@router.patch("/users/{user}", responses=problems(409))
def change_user(
    request: Request, _user: access.Administrator, user: UserName, change: UserChange
) -> UserSummary:
    """Change somebody's role or password; the person has to sign in again."""
    summary = _summary(request, user)
    try:
        access.service_of(request).accounts.change_user(user, role=change.role, password=change.password)
    except InputError as error:
        raise Problem(409, str(error)) from error
    return summary.model_copy(update={"role": change.role or summary.role})


@router.delete("/users/{user}", status_code=204, responses=problems(409))
def remove_user(request: Request, _user: access.Administrator, user: UserName) -> None:
    """Remove a user with all sign-ins and tokens. The last admin stays."""
    _summary(request, user)
    try:
        access.service_of(request).accounts.remove_user(user)
    except InputError as error:
        raise Problem(409, str(error)) from error


@router.get("/tokens")
def list_tokens(request: Request, user: access.SignedIn) -> list[TokenSummary]:
    """One's own bearer tokens."""
    rows = access.service_of(request).accounts.tokens(user.name)
    return [TokenSummary.model_validate(row, from_attributes=True) for row in rows]


@router.post("/tokens", status_code=201)
def issue_token(request: Request, user: access.Person, wanted: TokenRequest) -> NewToken:
    """Make a bearer token for a script or a notebook. Who asks with a token cannot make another."""
    if not user.role.covers(wanted.scope):
        raise Problem(403, f"The scope {wanted.scope} exceeds {user.role}.")
    issued = access.service_of(request).accounts.issue_token(
        user.name,
        wanted.label,
        wanted.scope,
        wanted.days * 86400.0,
        sign_in=request.session.get(access.SIGN_IN_KEY),
    )
    return NewToken.model_validate(issued, from_attributes=True)


@router.delete("/tokens/{token}", status_code=204)
def revoke_token(
    request: Request, user: access.Person, token: Annotated[str, Path(pattern=text_forms.TOKEN)]
) -> None:
    """End one of one's own tokens."""
    if not access.service_of(request).accounts.revoke_token(user.name, token):
        raise not_found("token of yours", token)


def _summary(request: Request, name: str) -> UserSummary:
    for row in access.service_of(request).accounts.users():
        if row.name == name:
            return UserSummary(name=row.name, role=Role(row.role), created=row.created)
    raise not_found("user", name)
