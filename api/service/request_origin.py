"""Where a request comes from: under which name this service was asked, and by which site's page."""

from urllib.parse import urlsplit

from starlette.requests import HTTPConnection

from api.service.problems import Problem
from api.service.settings import ServiceSettings, is_loopback

PROXY_HEADERS = ("forwarded", "x-forwarded-for", "x-forwarded-host", "x-real-ip", "via")
"""Which of them a proxy adds differs; with one of them a request from this machine is somebody else's."""


def check_host(connection: HTTPConnection, settings: ServiceSettings) -> None:
    """A name that is not ours means that a foreign page had its own name resolve to this machine (DNS rebinding).

    Raises the problem 400.
    """
    if "host" not in connection.headers:
        return  # HTTP/1.0, as an old controller asks; every browser names the host
    host = (urlsplit("//" + connection.headers["host"]).hostname or "").lower()
    if not settings.bound_to_loopback and not settings.allowed_hosts:
        return
    if is_loopback(host) or host == settings.host.strip("[]").lower() or host in settings.allowed_hosts:
        return
    raise Problem(400, f"This service is not called {host!r}; start it with --allow-host {host} if it is.")


def check_origin(connection: HTTPConnection, *, any_port: bool = False) -> None:
    """Browsers say which site a request comes from; only this one may change something or listen.

    any_port : also a page of the same host that came from another port, as ours does at the stop's own port

    Raises the problem 403.
    """
    ours = ("same-origin", "same-site", "none") if any_port else ("same-origin", "none")
    if connection.headers.get("sec-fetch-site", "same-origin") not in ours:
        raise Problem(403, "The request comes from another site.")
    origin, host = connection.headers.get("origin"), connection.headers.get("host", "")
    if origin is None:
        return
    here = urlsplit(origin)
    same = here.hostname == urlsplit("//" + host).hostname if any_port else here.netloc == host
    if not same:
        raise Problem(403, "The request comes from another site.")


def says_its_site(connection: HTTPConnection) -> bool:
    """Whether a browser said which site the request comes from, so that `check_origin` has judged it."""
    return "origin" in connection.headers or "sec-fetch-site" in connection.headers


def came_through_a_proxy(connection: HTTPConnection) -> bool:
    """Whether a proxy stands between: then not everybody who asks from this machine is at it."""
    return any(name in connection.headers for name in PROXY_HEADERS)
