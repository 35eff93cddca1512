"""The axis comes to rest within 0.6 s of a stop, whatever state the service is in; within 2.2 s where the service is gone.

By each of the ways that a stop can take: a browser's button (cookie), a program (token), a terminal (`coulomb stop`).
"""

import os
import signal
import ssl
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor

import httpx
import pytest

from api.service.pulse import OLD
from tests.attack.stand import Axis, Stand, comes_to_rest, running_service, wait_until
from tests.attack.states import STATES, State, database_locked, descriptors_out, loop_frozen
from tests.attack.ways import WAYS, by_terminal

LONGEST = 0.6
"""s from the stop until the axis rests"""
DEAD_MAN = 2.2
"""s likewise where the service's process does not run any more"""


@pytest.mark.parametrize("state", STATES, ids=lambda state: state.__name__)
@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_the_axis_rests_in_time_after_a_stop(stand: Stand, state: State, way, record_property):
    press = way(stand)
    with stand.motion() as axis, state(stand):
        wait_until(lambda: axis.speed_at(axis.rows[-1][0]) > 0.3, 10)
        pressed = time.monotonic()
        press()
        took = _rest(axis, pressed)
    record_property("rest", took)
    # A terminal's stop is a program that must be loaded first.
    assert took < LONGEST + (0.6 if way is by_terminal else 0.0)


def _rest(axis: Axis, since: float) -> float:
    comes_to_rest(axis, timeout=20)
    took = axis.rest_after(since)
    print(f"\nrest after {took:.3f} s")
    return took


@pytest.mark.parametrize(
    ("end", "within"), [(signal.SIGSTOP, DEAD_MAN), (signal.SIGKILL, LONGEST)], ids=["stopped", "killed"]
)
def test_the_axis_rests_in_time_where_the_service_is_gone(stand: Stand, end, within):
    with stand.motion() as axis:
        ended = time.monotonic()
        os.kill(stand.process.pid, end)
        comes_to_rest(axis, after=0.5, timeout=20)
        assert axis.rest_after(ended) < within


@pytest.mark.parametrize(("trap", "within"), [("freeze", DEAD_MAN + OLD), ("hold", DEAD_MAN)])
def test_a_service_that_stays_frozen_ends_the_motion_by_itself(stand: Stand, trap, within):
    """Its event loop alone (the sign of life is given until the loop's pulse is old), or all of its threads."""
    with stand.motion() as axis, ThreadPoolExecutor(1) as pool, stand.client(timeout=20) as mallory:
        frozen = time.monotonic()
        freezing = pool.submit(mallory.post, f"/{trap}/6")
        comes_to_rest(axis, after=0.5, timeout=20)
        assert axis.rest_after(frozen) < within
        freezing.result()
    with stand.client("ada") as ada:
        session = ada.get("/experiments/arm/sessions").json()[-1]
        assert session["state"] in ("aborted", "faulted")
        assert "did not respond" in session["reason"]


def test_the_audit_row_of_a_stop_follows_once_the_database_takes_it(stand: Stand):
    with stand.motion() as axis:
        with database_locked(stand):
            with stand.client("vera", timeout=1.5) as vera:
                assert vera.post("/rigs/bench/stop").json() == {"stopped": True}
            comes_to_rest(axis)
        with stand.client("root") as root:

            def logged() -> bool:
                return any(row["action"] == "POST /rigs/{rig}/stop" for row in root.get("/audit").json())

            wait_until(logged, 30)


def test_under_tls_the_stop_has_a_port_of_its_own_that_a_frozen_loop_does_not_touch(tmp_path):
    certificate, key = tmp_path / "certificate.pem", tmp_path / "key.pem"
    names = "subjectAltName=DNS:localhost,IP:127.0.0.1"
    request = "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost"
    files = ["-addext", names, "-keyout", str(key), "-out", str(certificate)]
    subprocess.run([*request.split(), *files], check=True, capture_output=True)
    with running_service(tmp_path, tls=(certificate, key)) as stand:
        browser = stand.browser("vera")
        page = browser.get("/pages/rig")
        port = int(page.headers["Stop-Port"])
        assert f'name="stop-port" content="{port}"' in page.text
        assert f"https://localhost:{port}" in page.headers["Content-Security-Policy"]
        with stand.motion() as axis, descriptors_out(stand), loop_frozen(stand):
            wait_until(lambda: axis.speed_at(axis.rows[-1][0]) > 0.3, 10)
            pressed = time.monotonic()
            # As the page asks: another origin of the same host, with the cookie and nothing else.
            answer = httpx.post(
                f"https://localhost:{port}/pages/stop",
                headers={"Origin": stand.address, "Sec-Fetch-Site": "same-site"},
                cookies=browser.cookies,
                verify=ssl.create_default_context(cafile=certificate),
                timeout=2,
            )
            assert answer.json()["stopped"] == ["bench"]
            assert answer.headers["Access-Control-Allow-Origin"] == stand.address
            assert _rest(axis, pressed) < LONGEST
            # At the service's own port too, by a new connection.
            with httpx.Client(verify=ssl.create_default_context(cafile=certificate), timeout=2) as client:
                token = {"Authorization": f"Bearer {stand.tokens['vera']}"}
                assert client.post(f"{stand.address}/rigs/bench/stop", headers=token).is_success


def test_a_stranger_and_a_foreign_page_stop_nothing(stand: Stand):
    with stand.motion() as axis:
        with stand.client() as stranger:
            assert stranger.post("/pages/stop").status_code == 401
        foreign = stand.browser("vera")
        headers = {"Origin": "http://evil.example", "Sec-Fetch-Site": "cross-site"}
        assert foreign.post("/pages/stop", headers=headers).status_code == 403
        # It goes on, from where it turns round too.
        wait_until(lambda: axis.speed_at(axis.rows[-1][0]) > 0.3, 10)
        with stand.client("vera") as vera:
            assert vera.post("/rigs/bench/stop").json() == {"stopped": True}
        comes_to_rest(axis)
