"""Templates and the headers of a page.

Nothing on a page comes from another host, and no script stands in the markup: the content security policy says so to the
browser.
"""

import gzip
from collections.abc import Iterator
from functools import cache
from typing import Any

from fastapi import Request
from fastapi.responses import HTMLResponse
from jinja2 import Environment, PackageLoader, StrictUndefined

from api.pages import number_format
from api.pages.static_content import static_address

PREFIX = "/pages"
"""Address under which the pages live; the REST calls stand at the root."""

CONTENT_SECURITY_POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' data:",
        "font-src 'self'",
        "connect-src 'self'",
        "form-action 'self'",
        "base-uri 'none'",
        "frame-ancestors 'none'",
    )
)
PAGE_HEADERS = {
    "Content-Security-Policy": CONTENT_SECURITY_POLICY,
    "Referrer-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}

COMPRESSED_FROM = 1 << 14
"""bytes of a page that is sent compressed: below, a packet or two are all there is to save"""
GZIP_LEVEL = 5
"""a sixth of the size of pages with figures, in a few milliseconds"""

Context = dict[str, Any]
"""What a template is given, by name. Any: Jinja looks names up when it renders; what is shown of a result is a document."""

FILTERS = (
    "number",
    "significant",
    "with_deviation",
    "percent",
    "percent_number",
    "probability",
    "certainty",
    "duration",
    "moment",
    "listing",
    "equation",
    "symbol",
    "unit",
    "with_commands",
)
"""Functions of `number_format` that templates use."""

STEPS = (
    ("rig", "Rig"),
    ("new-session", "New session"),
    ("live", "Live"),
    ("model", "Model and measurement"),
    ("missing", "What is missing"),
    ("results", "Results"),
)
"""The pages in the operator's order: the last word of the address, and the name."""


@cache
def environment() -> Environment:
    """The templates, with the formats of numbers as filters."""
    made = Environment(
        loader=PackageLoader("api.pages"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    for name in FILTERS:
        made.filters[name] = getattr(number_format, name)
    made.globals.update(static=static_address, prefix=PREFIX, steps=STEPS)
    return made


def render(template: str, **context: Any) -> str:
    """A template as text."""
    return environment().get_template(template).render(**context)


def render_pieces(template: str, **context: Any) -> Iterator[str]:
    """A template as text, piece by piece: what stands further down is asked for when it is written."""
    return environment().get_template(template).generate(**context)


def page(request: Request, template: str, *, status: int = 200, **context: Any) -> HTMLResponse:
    """A page or a fragment as a response; the theme that the operator chose comes from its cookie.

    Where the stop has a port of its own, the page is told, and may ask there. A large page is compressed where the browser takes
    that; the one secret in it, the token against foreign requests, is masked (`access.masked`).
    """
    theme = request.cookies.get("theme", "auto")
    context.setdefault("theme", theme if theme in ("light", "dark") else "auto")
    port = getattr(request.app.state, "stop_port", None)
    context["stop_port"] = port
    headers = PAGE_HEADERS
    if port is not None:
        allowed = f"connect-src 'self' https://{request.url.hostname}:{port}"
        policy = CONTENT_SECURITY_POLICY.replace("connect-src 'self'", allowed)
        headers = {**PAGE_HEADERS, "Content-Security-Policy": policy}
    content = render(template, **context).encode()
    # What answers a change may hold a secret that is shown once (a token, made from words of the request).
    if request.method == "GET" and len(content) > COMPRESSED_FROM:
        headers = headers | {"Vary": "Accept-Encoding"}
        if "gzip" in request.headers.get("accept-encoding", ""):
            content = gzip.compress(content, GZIP_LEVEL, mtime=0)
            headers = headers | {"Content-Encoding": "gzip"}
    return HTMLResponse(content, status_code=status, headers=headers)
