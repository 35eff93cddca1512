"""The REST calls are read in the service's own pages: nothing comes from another host, and only for who is signed in."""

import re

import httpx


def test_every_call_of_the_document_stands_on_the_page_and_nothing_comes_from_elsewhere(
    browser_client: httpx.Client,
) -> None:
    answer = browser_client.get("/docs")
    assert answer.status_code == 200
    assert "script-src 'self'" in answer.headers["content-security-policy"]
    assert "unsafe" not in answer.headers["content-security-policy"]
    loaded = re.findall(r'(?:src|href)="([^"]+)"', answer.text)
    assert not [each for each in loaded if not each.startswith(("/", "#"))]
    shown = re.findall(r'data-method="(\w+)" data-path="([^"]+)"', answer.text)
    paths = browser_client.get("/openapi.json").json()["paths"]
    assert sorted(shown) == sorted(
        (method.upper(), path) for path, calls in paths.items() for method in calls
    )
    anchors = re.findall(r'id="([^"]+)"', answer.text)
    assert len(anchors) == len(set(anchors))
    assert {each[1:] for each in loaded if each.startswith("#")} <= set(anchors)
