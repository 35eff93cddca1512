"""The REST calls are read in the service's own pages: nothing comes from another host, and only for who is signed in."""

import re

import httpx


def test_the_viewer_comes_with_the_service(browser_client: httpx.Client) -> None:
    answer = browser_client.get("/docs")
    assert answer.status_code == 200
    assert "script-src 'self'" in answer.headers["content-security-policy"]
    assert "unsafe" not in answer.headers["content-security-policy"]
    loaded = re.findall(r'(?:src|href)="([^"]+)"', answer.text)
    assert not [each for each in loaded if not each.startswith(("/", "#"))]
    for name in ("vendor/swagger-ui-bundle.js", "vendor/swagger-ui.css", "rest.js"):
        (address,) = [each for each in loaded if each.endswith(name)]
        assert browser_client.get(address).status_code == 200
    script = browser_client.get(next(each for each in loaded if each.endswith("/rest.js"))).text
    assert "http" not in script
    assert "validatorUrl: null" in script


def test_the_address_leads_to_the_rig_once_there_is_an_experiment(browser_client: httpx.Client) -> None:
    assert browser_client.get("/", follow_redirects=False).headers["location"] == "/pages/rig"
