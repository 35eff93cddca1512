"""Users with roles, their browsers' sign-ins and their bearer tokens.

Passwords are hashed with Argon2id (argon2-cffi's RFC 9106 profile); sign-ins and tokens are 256-bit random
texts of which only the SHA-256 is stored, which is enough for a secret that nobody chose.
"""

import hashlib
import re
import secrets
from base64 import b64encode
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError
from sqlalchemy import delete, func, select, update

from api.service.account_documents import Role
from api.service.database import Database, SignInRow, TokenRow, UserRow
from api.service.new_password import LONGEST_PASSWORD, check_new_password
from api.service.text_forms import USER_NAME
from identify.recording.errors import InputError

TOKEN_PREFIX = "coulomb_"
"""Makes a leaked token recognisable to secret scanners."""
LONGEST_TOKEN_LIFE = 366 * 86400.0


@dataclass(frozen=True)
class User:
    """Who asks: name, role (for a bearer token the token's scope, if smaller) and how it was shown.

    via : `cookie`, `token`, or `local` for the operator at the machine itself before any account exists
    """

    name: str
    role: Role
    via: str


@dataclass(frozen=True)
class CheckedPassword:
    """A user whose password was right, and the hash that it was right for: a change in the same moment voids it."""

    user: User
    password_hash: str


LOCAL_OPERATOR = User("local operator", Role.OPERATOR, "local")


@dataclass(frozen=True)
class IssuedToken:
    """A bearer token just made; `secret` is shown this once."""

    id: str
    user: str
    label: str
    scope: Role
    created: float
    expires: float
    secret: str


def digest(secret: str) -> str:
    """SHA-256 of a sign-in's or a token's secret: all that is stored of it."""
    return hashlib.sha256(secret.encode()).hexdigest()


@cache
def _hash_of_nobody() -> str:
    """A hash that no password has: to check one against it takes as long as against any other, from the first time on."""
    cost = PasswordHasher()
    salt, hashed = (
        b64encode(secrets.token_bytes(length)).decode().rstrip("=")
        for length in (cost.salt_len, cost.hash_len)
    )
    return f"$argon2id$v=19$m={cost.memory_cost},t={cost.time_cost},p={cost.parallelism}${salt}${hashed}"


class Accounts:
    """Users, sign-ins and tokens in the database. Raises InputError for what a person typed wrongly.

    on_issue : is told of each new sign-in and token, and whose it is, before anybody has it
    """

    def __init__(
        self,
        database: Database,
        clock: Callable[[], float],
        on_issue: Callable[[str, User], None] = lambda _secret, _user: None,
    ) -> None:
        self._database = database
        self._clock = clock
        self._on_issue = on_issue
        self._hasher = PasswordHasher()
        self._any_user = False

    def exist(self) -> bool:
        """True once there is a user; from then on everybody signs in."""
        if not self._any_user:
            with self._database.transaction() as session:
                self._any_user = bool(session.scalar(select(func.count()).select_from(UserRow)))
        return self._any_user

    # --- users

    def add_user(self, name: str, password: str, role: Role) -> User:
        """Create a user."""
        if not re.fullmatch(USER_NAME, name):
            raise InputError(
                f"user name {name!r}: use 1 to 64 lower-case letters, digits, '.', '_' or '-', a letter first"
            )
        hashed = self._hash(name, password)
        with self._database.transaction(alone=True) as session:
            if session.get(UserRow, name):
                raise InputError(f"user {name} exists already")
            session.add(UserRow(name=name, role=role, password_hash=hashed, created=self._clock()))
        return User(name, role, "cookie")

    def users(self) -> list[UserRow]:
        """All users by name."""
        with self._database.transaction() as session:
            return list(session.scalars(select(UserRow).order_by(UserRow.name)))

    def change_user(
        self,
        name: str,
        *,
        role: Role | None = None,
        password: str | None = None,
        by: CheckedPassword | None = None,
    ) -> UserRow:
        """Change role or password; the user's browsers have to sign in again, and after a new password the
        tokens are void too.

        by : the person's own password, which must still be that; None for an administrator
        """
        hashed = None if password is None else self._hash(name, password)
        with self._database.transaction(alone=True) as session:
            row = self._existing(session, name)
            if by is not None:
                self._refuse_old_password(row, by)
            if role is not None and role != Role.ADMIN:
                self._refuse_losing_last_admin(session, row)
            row.role = role or row.role
            row.password_hash = hashed or row.password_hash
            session.execute(delete(SignInRow).where(SignInRow.user == name))
            if hashed:
                session.execute(delete(TokenRow).where(TokenRow.user == name))
        return row

    def remove_user(self, name: str) -> None:
        """Remove a user with sign-ins and tokens; the last admin stays."""
        with self._database.transaction(alone=True) as session:
            row = self._existing(session, name)
            self._refuse_losing_last_admin(session, row)
            session.execute(delete(SignInRow).where(SignInRow.user == name))
            session.execute(delete(TokenRow).where(TokenRow.user == name))
            session.delete(row)

    def _existing(self, session, name: str) -> UserRow:
        row = session.get(UserRow, name)
        if row is None:
            raise InputError(f"there is no user {name}")
        return row

    @staticmethod
    def _refuse_old_password(row: UserRow, checked: CheckedPassword) -> None:
        if row.password_hash != checked.password_hash:
            raise InputError(f"the password of {row.name} was changed in the same moment; sign in again")

    def _refuse_losing_last_admin(self, session, row: UserRow) -> None:
        if row.role != Role.ADMIN:
            return
        admins = session.scalar(select(func.count()).select_from(UserRow).where(UserRow.role == Role.ADMIN))
        if admins == 1:
            raise InputError(f"{row.name} is the last admin; make another user admin first")

    def _hash(self, name: str, password: str) -> str:
        check_new_password(name, password)
        return self._hasher.hash(password)

    # --- browsers

    def check_password(self, name: str, password: str) -> CheckedPassword | None:
        """The user if the password is right, else None; takes as long for an unknown name."""
        row = None
        if re.fullmatch(USER_NAME, name):
            with self._database.transaction() as session:
                row = session.get(UserRow, name)
        # An attempt takes as long whether the name exists or not.
        stored = row.password_hash if row else _hash_of_nobody()
        try:
            self._hasher.verify(stored, password[:LONGEST_PASSWORD])
        except (VerificationError, InvalidHashError):
            return None
        return CheckedPassword(User(row.name, Role(row.role), "cookie"), row.password_hash) if row else None

    def open_sign_in(self, checked: CheckedPassword, lasts: float) -> str:
        """A new sign-in; the text returned is what the browser's cookie carries.

        Raises InputError if the user was removed or has another password since it was checked.
        """
        secret = secrets.token_urlsafe(32)
        now = self._clock()
        with self._database.transaction(alone=True) as session:
            row = self._existing(session, checked.user.name)
            self._refuse_old_password(row, checked)
            session.execute(delete(SignInRow).where(SignInRow.expires < now))
            session.add(SignInRow(id_hash=digest(secret), user=row.name, expires=now + lasts))
        self._on_issue(secret, checked.user)
        return secret

    def user_of_sign_in(self, secret: str) -> User | None:
        """Whose sign-in it is, or None if it is unknown, ended or expired."""
        with self._database.transaction() as session:
            row = session.get(SignInRow, digest(secret))
            if row is None or row.expires < self._clock():
                return None
            user = session.get(UserRow, row.user)
        return User(user.name, Role(user.role), "cookie") if user else None

    def close_sign_in(self, secret: str) -> None:
        """End a sign-in; nothing happens if it has ended already."""
        with self._database.transaction() as session:
            session.execute(delete(SignInRow).where(SignInRow.id_hash == digest(secret)))

    # --- tokens

    def issue_token(
        self, user_name: str, label: str, scope: Role, lasts: float, *, sign_in: str | None = None
    ) -> IssuedToken:
        """A bearer token for `lasts` seconds; its scope cannot exceed the user's role.

        sign_in : by which it is asked for, and which must not have ended meanwhile; None on the command line
        """
        if not 0 < lasts <= LONGEST_TOKEN_LIFE:
            raise InputError(f"token: it lasts between 0 and {LONGEST_TOKEN_LIFE / 86400:.0f} days")
        if not label.isprintable():
            raise InputError("token: its label holds a character that cannot be printed")
        secret = TOKEN_PREFIX + secrets.token_urlsafe(32)
        now = self._clock()
        with self._database.transaction(alone=True) as session:
            user = self._existing(session, user_name)
            if sign_in is not None and session.get(SignInRow, digest(sign_in)) is None:
                raise InputError(f"token: the sign-in of {user_name} has ended; sign in again")
            if not Role(user.role).covers(scope):
                raise InputError(f"token: scope {scope} exceeds the role {user.role} of {user_name}")
            row = TokenRow(
                id=secrets.token_hex(8),
                user=user_name,
                label=label[:100],
                token_hash=digest(secret),
                scope=scope,
                created=now,
                expires=now + lasts,
                last_used=None,
            )
            session.add(row)
            owner = _by_token(row, user)
        self._on_issue(secret, owner)
        return IssuedToken(row.id, user_name, row.label, scope, row.created, row.expires, secret)

    def tokens(self, user_name: str) -> list[TokenRow]:
        """The tokens of one user, oldest first."""
        with self._database.transaction() as session:
            return list(
                session.scalars(select(TokenRow).where(TokenRow.user == user_name).order_by(TokenRow.created))
            )

    def revoke_token(self, user_name: str, identifier: str) -> bool:
        """End a token of that user; False if there is none with that id."""
        with self._database.transaction(alone=True) as session:
            row = session.get(TokenRow, identifier)
            if row is None or row.user != user_name:
                return False
            session.delete(row)
        return True

    def user_of_token(self, secret: str) -> User | None:
        """Whose token it is, with the smaller of scope and role, or None if unknown or expired."""
        now = self._clock()
        with self._database.transaction() as session:
            row = session.scalar(select(TokenRow).where(TokenRow.token_hash == digest(secret)))
            if row is None or row.expires < now:
                return None
            user = session.get(UserRow, row.user)
            if user is None:
                return None
            # One write a minute at most: a notebook polls often.
            if row.last_used is None or now - row.last_used > 60:
                used = update(TokenRow).where(TokenRow.id == row.id).values(last_used=now)
                # Revoked since it was read: then there is none, and that is no error.
                if not session.execute(used.returning(TokenRow.id)).all():
                    return None
        return _by_token(row, user)

    def let_in(self) -> dict[str, User]:
        """Whom every sign-in and token that has not expired lets in, by the secret's digest."""
        now = self._clock()
        with self._database.transaction() as session:
            users = {row.name: row for row in session.scalars(select(UserRow))}
            sign_ins = session.scalars(select(SignInRow).where(SignInRow.expires >= now)).all()
            tokens = session.scalars(select(TokenRow).where(TokenRow.expires >= now)).all()
        admitted = {
            row.id_hash: User(row.user, Role(users[row.user].role), "cookie")
            for row in sign_ins
            if row.user in users
        }
        for row in tokens:
            if row.user in users:
                admitted[row.token_hash] = _by_token(row, users[row.user])
        return admitted


def _by_token(token: TokenRow, user: UserRow) -> User:
    """The user of a token, with the smaller of scope and role."""
    scope, role = Role(token.scope), Role(user.role)
    return User(user.name, scope if role.covers(scope) else role, "token")
