"""The stop as a request: who may, what it means, and the answer, without a database, a file or a lock.

The guard asks here before anything else, in the event loop; the acceptor (`api/acceptor.py`) asks here in its own thread
for connections that no event loop has seen. Both give a request as an ASGI scope. What is not ours to answer (somebody
whom we have never let in, a rig that nothing has used) goes the way of every other request.
"""

import re
from dataclasses import dataclass
from urllib.parse import unquote

from starlette.requests import HTTPConnection
from starlette.types import Scope

from api.service.access import CSRF_HEADER, CSRF_KEY, SIGN_IN_KEY, client_address, is_token
from api.service.accounts import LOCAL_OPERATOR, User
from api.service.problems import Problem
from api.service.request_origin import came_through_a_proxy, check_host, check_origin, says_its_site
from api.service.rig_stop import RigStop
from api.service.settings import ServiceSettings
from api.service.stop_log import StopLog
from api.service.stop_passes import StopPasses
from identify.results.document import Json

EVERYTHING, RIG, SESSION = (
    "/pages/stop",
    "/rigs/{rig}/stop",
    "/experiments/{experiment}/sessions/{session}/stop",
)
_STOPS = tuple(
    (re.compile(re.sub(r"\{(\w+)\}", r"(?P<\1>[^/]+)", pattern)), pattern)
    for pattern in (EVERYTHING, RIG, SESSION)
)
STOP_REQUEST = re.compile(rb"POST \S{0,2000}/stop[? ]")
"""Matches the begin of a request that may be a stop, before anybody has parsed it."""


@dataclass(frozen=True)
class StopAnswer:
    """What the person is told: HTTP status and JSON."""

    status: int
    content: Json


@dataclass(frozen=True)
class StopOrder:
    """What is to stop.

    action : the route, as the audit log names it
    names  : rig, or experiment and session; nothing for everything
    """

    action: str
    names: dict[str, str]

    @classmethod
    def of(cls, method: str, path: str) -> "StopOrder | None":
        """The order that this request is; None for every other request. `path` may still be percent-encoded."""
        if method != "POST":
            return None
        for pattern, route in _STOPS:
            if match := pattern.fullmatch(path):
                names = {name: unquote(value) for name, value in match.groupdict().items()}
                return cls(f"POST {route}", names)
        return None


class StopRequests:
    """Answers stops."""

    def __init__(
        self, rig_stop: RigStop, passes: StopPasses, log: StopLog, settings: ServiceSettings
    ) -> None:
        self._rig_stop = rig_stop
        self._passes = passes
        self._log = log
        self._settings = settings

    def answer(self, scope: Scope, *, any_port: bool = False) -> StopAnswer | None:
        """Stop what the request says, and the answer; None where it is no stop, or not one that can be judged here.

        scope    : of an HTTP request, with `session` as its cookie says
        any_port : the request came to the stop's own port

        Raises Problem for a foreign host or site.
        """
        order = StopOrder.of(scope["method"], scope["path"])
        if order is None:
            return None
        connection = HTTPConnection(scope)
        check_host(connection, self._settings)
        check_origin(connection, any_port=any_port)
        user = self._who(connection)
        return None if user is None else self.obey(order, user, scope["path"], client_address(connection))

    def obey(self, order: StopOrder, user: User, path: str, client: str) -> StopAnswer | None:
        """Stop, for somebody who may; None for a rig or session that nothing has used."""
        stopped = self._stop(order.names, user.name)
        if stopped is None:
            return None
        # After the stop, and written whenever it can be.
        self._log.append(user, order.action, path, "200", client)
        return StopAnswer(200, stopped)

    def _stop(self, names: dict[str, str], by: str) -> Json | None:
        if "rig" in names:
            stopped = self._rig_stop.stop(names["rig"], by)
        elif names:
            stopped = self._rig_stop.stop_session(names["experiment"], names["session"], by)
        else:
            return everything_stopped(self._rig_stop, by)
        return None if stopped is None else {"stopped": stopped}

    def _who(self, connection: HTTPConnection) -> User | None:
        """Who asks, if they may stop; None where that is not known here."""
        scheme, _, secret = connection.headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer":
            return self._passes.owner(secret.strip())
        session = connection.session
        # A page that is older than its sign-in still stops: that its own site asks is enough.
        sent, token = connection.headers.get(CSRF_HEADER), session.get(CSRF_KEY)
        by_its_own_page = says_its_site(connection) or (
            sent is None if token is None else is_token(sent, token)
        )
        if not by_its_own_page:
            return None
        if (secret := session.get(SIGN_IN_KEY)) and (user := self._passes.owner(str(secret))):
            return user
        only_from_here = self._settings.bound_to_loopback and not came_through_a_proxy(connection)
        return LOCAL_OPERATOR if self._passes.local_operator and only_from_here else None


def everything_stopped(rig_stop: RigStop, by: str) -> Json:
    """Bring every rig to rest, for the person of that name; ids of those that moved, and words for the page."""
    rigs = rig_stop.stop_everything(by)
    return {"stopped": rigs, "words": f"{', '.join(rigs)}: stopping." if rigs else "Nothing was moving."}


def problem_of(problem: Problem) -> Json:
    """A problem document's members that every reader knows."""
    return {"type": "about:blank", "title": "Refused", "status": problem.status, "detail": problem.detail}
