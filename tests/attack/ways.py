"""The ways that a stop can take to the service: a browser's button (cookie), a program (token), a terminal (`coulomb stop`)."""

import subprocess
import sys
from collections.abc import Callable

import httpx

from tests.attack.stand import ROOT, Stand

Way = Callable[[Stand], Callable[[], object]]
"""Makes ready what stops; called, it stops"""


def by_page(stand: Stand) -> Callable[[], object]:
    """The button of a page that is open already: a kept connection."""
    browser = stand.browser("vera")
    return lambda: _post(browser)


def by_new_page(stand: Stand) -> Callable[[], object]:
    """A page's button whose connection was closed meanwhile: a new one."""
    signed_in = stand.browser("vera")
    # Made before, as a browser runs before its button is pressed; it has no connection yet.
    browser = httpx.Client(
        base_url=stand.address, headers=signed_in.headers, cookies=signed_in.cookies, verify=stand.verify
    )
    stand.browsers.append(browser)
    return lambda: _post(browser)


def _post(browser: httpx.Client) -> object:
    try:
        return browser.post("/pages/stop", timeout=1.5)
    except httpx.HTTPError:
        return None  # the answer waits for the frozen loop; the axis does not


def by_token(stand: Stand) -> Callable[[], object]:
    """A program that has not asked anything yet."""

    client = stand.client("vera", timeout=1.5)
    stand.browsers.append(client)
    return lambda: client.post("/rigs/bench/stop")


def by_terminal(stand: Stand) -> Callable[[], object]:
    """`coulomb stop`, at the computer itself; the time of its start counts."""
    command = [sys.executable, "-m", "api", "stop", "bench", "--data", str(stand.data)]
    return lambda: subprocess.run(command, cwd=ROOT, check=True, capture_output=True, timeout=10)


WAYS = (by_page, by_new_page, by_token, by_terminal)
