"""Who asks, and what they may do: the dependencies that routes declare.

Every route that is not public says its role by one of `Viewer`, `Operator`, `Administrator` (or `SignedIn`,
which any role is); `create_application` refuses to start with a route that says nothing.
"""

import secrets
from collections.abc import Awaitable, Callable
from typing import Annotated, Any

from fastapi import Depends
from starlette.requests import HTTPConnection

from api.service.accounts import CheckedPassword, Role, User
from api.service.problems import Problem
from api.service.service import Service
from identify.recording.errors import InputError

CSRF_HEADER = "X-CSRF-Token"
SIGN_IN_KEY = "sign_in"
CSRF_KEY = "csrf"
STILL_WELCOME_KEY = "still_welcome"
"""Key of a WebSocket's scope under which the guard leaves a question to be asked again while it stays open."""


def service_of(connection: HTTPConnection) -> Service:
    """The running service."""
    return connection.app.state.service


def client_address(connection: HTTPConnection) -> str:
    """Network address of who asks, or an empty text where there is none."""
    return connection.client.host if connection.client else ""


def user_or_none(connection: HTTPConnection) -> User | None:
    """Who asks, as the guard found out, or None."""
    return connection.scope.get("user")


async def still_welcome(connection: HTTPConnection) -> bool:
    """Whether a connection that stays open would still be let in: its sign-in may have ended since."""
    return await connection.scope[STILL_WELCOME_KEY]()


def check_role(user: User | None, role: Role) -> User:
    """Who asks, if that may be answered. Raises the problem 401 if nobody is signed in, 403 if the role does not suffice."""
    if user is None:
        raise Problem(401, "Sign in, or send a bearer token.", {"WWW-Authenticate": "Bearer"})
    if not user.role.covers(role):
        raise Problem(403, f"This needs the role {role}; {user.name} asks as {user.role}.")
    return user


def _at_least(role: Role) -> Callable[..., Awaitable[User]]:
    async def needs(connection: HTTPConnection) -> User:
        return check_role(user_or_none(connection), role)

    needs.minimum_role = role  # type: ignore[attr-defined]
    return needs


needs_viewer = _at_least(Role.VIEWER)
needs_operator = _at_least(Role.OPERATOR)
needs_administrator = _at_least(Role.ADMIN)


async def _person(user: Annotated[User, Depends(needs_viewer)]) -> User:
    if user.via == "token":
        raise Problem(
            403, "A bearer token makes and ends no tokens and changes no password: sign in with your name."
        )
    if user.via == "local":
        raise Problem(403, "The local operator has no account: create one with `coulomb users add`.")
    return user


async def public() -> None:
    """Declared by the few routes that answer without a sign-in."""


public.minimum_role = None  # type: ignore[attr-defined]

Public = Depends(public)
Viewer = Annotated[User, Depends(needs_viewer)]
SignedIn = Viewer
Person = Annotated[User, Depends(_person)]
"""Who signed in with name and password: a token that somebody else got hold of ends when it expires, and makes no other."""
Operator = Annotated[User, Depends(needs_operator)]
Administrator = Annotated[User, Depends(needs_administrator)]


def csrf_token(connection: HTTPConnection) -> str:
    """The token that the page sends back in `X-CSRF-Token` with everything that changes something."""
    session = connection.session
    if CSRF_KEY not in session:
        session[CSRF_KEY] = secrets.token_urlsafe(32)
    return session[CSRF_KEY]


def masked(token: str) -> str:
    """The token as a page holds it: other letters in every answer, so that the length of a compressed page, beside words of
    somebody else's making, tells nothing of it. A random pad, and the token on it, in hexadecimal digits."""
    plain = token.encode()
    pad = secrets.token_bytes(len(plain))
    return (pad + bytes(a ^ b for a, b in zip(plain, pad, strict=True))).hex()


def is_token(sent: str | None, token: str) -> bool:
    """Whether what came in `X-CSRF-Token` is the token, as it is or masked."""
    if sent is None:
        return False
    plain = token.encode()
    try:
        both = bytes.fromhex(sent)
    except ValueError:
        both = b""
    if len(both) == 2 * len(plain):
        pad, on_it = both[: len(plain)], both[len(plain) :]
        return secrets.compare_digest(bytes(a ^ b for a, b in zip(on_it, pad, strict=True)), plain)
    return secrets.compare_digest(sent.encode(), plain)


def verify_password(connection: HTTPConnection, name: str, password: str) -> CheckedPassword:
    """The user whose name and password these are; attempts are throttled.

    Raises the problem 401 (wrong name or password), 429 (too many attempts, with Retry-After) or 503 (too many sign-ins).
    """
    service = service_of(connection)
    address = client_address(connection)
    with service.throttle.attempt(name, address):
        checked = service.accounts.check_password(name, password)
    if checked is None:
        raise Problem(401, "The name or the password is wrong.", {"WWW-Authenticate": "Bearer"})
    service.throttle.succeeded(name, address)
    return checked


def sign_in(connection: HTTPConnection, name: str, password: str) -> User:
    """Check name and password, and let the response's cookie carry the sign-in.

    Raises the problem 401 (wrong name or password) or 429 (too many attempts, with Retry-After).
    """
    connection.scope["audit_details"] = {"name": name}
    checked = verify_password(connection, name, password)
    connection.scope["user"] = checked.user
    service = service_of(connection)
    try:
        secret = service.accounts.open_sign_in(checked, service.settings.sign_in_lasts)
    except InputError as error:
        raise Problem(401, f"{error}.", {"WWW-Authenticate": "Bearer"}) from error
    # A cookie from before the sign-in gains no rights: everything in it is replaced.
    connection.session.clear()
    connection.session[SIGN_IN_KEY] = secret
    csrf_token(connection)
    return checked.user


def sign_out(connection: HTTPConnection) -> None:
    """End the browser's sign-in."""
    if secret := connection.session.get(SIGN_IN_KEY):
        service_of(connection).accounts.close_sign_in(secret)
    connection.session.clear()


def declared_role(route: Any) -> Role | str | None:
    """The role that a route needs, None for a public route, `undeclared` for one that says nothing."""
    least: Role | str | None = "undeclared"
    pending = [route.dependant]
    while pending:
        dependant = pending.pop()
        role = getattr(dependant.call, "minimum_role", "undeclared")
        if role == "undeclared":
            pass
        elif least in ("undeclared", None) or (role is not None and Role(role).covers(Role(least))):
            least = role
        pending.extend(dependant.dependencies)
    return least
