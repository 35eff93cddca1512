"""Under which names the service answers, and whose pages may ask it to change something."""

import pytest
from starlette.requests import HTTPConnection

from api.service.problems import Problem
from api.service.request_origin import came_through_a_proxy, check_host, check_origin, says_its_site
from api.service.settings import ServiceSettings


def asked(**headers: str) -> HTTPConnection:
    """A request with these headers; `sec_fetch_site` is Sec-Fetch-Site."""
    raw = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    return HTTPConnection({"type": "http", "headers": raw})


@pytest.mark.parametrize(
    ("settings", "host", "answered"),
    [
        ({}, "localhost:8000", True),
        ({}, "127.0.0.1:8000", True),
        ({}, "[::1]:8000", True),
        ({}, "evil.example", False),  # a page of that name whose address was turned to this machine
        ({"allowed_hosts": ("bench.lab",)}, "BENCH.lab:80", True),
        ({"allowed_hosts": ("bench.lab",)}, "other.lab", False),
        ({"host": "[::1]"}, "[::1]:9000", True),
        ({"host": "0.0.0.0"}, "whatever.lab", True),
        ({"host": "0.0.0.0", "allowed_hosts": ("bench.lab",)}, "whatever.lab", False),
    ],
)
def test_only_a_name_of_ours_is_answered(settings, host, answered):
    configured = ServiceSettings(**settings)
    if answered:
        check_host(asked(host=host), configured)
        return
    with pytest.raises(Problem) as refused:
        check_host(asked(host=host), configured)
    assert refused.value.status == 400
    assert f"--allow-host {host.partition(':')[0].lower()}" in str(refused.value.detail)


def test_a_controller_that_names_no_host_is_answered():
    check_host(asked(), ServiceSettings())


@pytest.mark.parametrize(
    ("headers", "anywhere", "with_any_port"),
    [
        ({}, True, True),  # no browser
        ({"sec_fetch_site": "same-origin"}, True, True),
        ({"sec_fetch_site": "none"}, True, True),  # typed or a bookmark
        ({"sec_fetch_site": "same-site"}, False, True),
        ({"sec_fetch_site": "cross-site"}, False, False),
        ({"origin": "http://bench.lab:8000"}, True, True),
        ({"origin": "http://bench.lab:8001"}, False, True),
        ({"origin": "http://evil.example:8000"}, False, False),
        ({"origin": "null"}, False, False),
        ({"origin": "http://bench.lab:8000", "sec_fetch_site": "cross-site"}, False, False),
    ],
)
def test_a_page_of_another_site_changes_nothing_and_one_of_another_port_only_stops(
    headers, anywhere, with_any_port
):
    request = asked(host="bench.lab:8000", **headers)
    for any_port, allowed in ((False, anywhere), (True, with_any_port)):
        if allowed:
            check_origin(request, any_port=any_port)
            continue
        with pytest.raises(Problem) as refused:
            check_origin(request, any_port=any_port)
        assert refused.value.status == 403


def test_a_browser_says_its_site_by_either_header():
    assert says_its_site(asked(origin="http://bench.lab"))
    assert says_its_site(asked(sec_fetch_site="none"))
    assert not says_its_site(asked(host="bench.lab"))


@pytest.mark.parametrize(
    "header", ["forwarded", "x_forwarded_for", "x_forwarded_host", "x_real_ip", "via", "host"]
)
def test_a_proxy_is_known_by_any_of_the_headers_that_proxies_add(header):
    assert came_through_a_proxy(asked(**{header: "10.0.0.7"})) is (header != "host")
