"""The REST calls are read in the service's own pages: nothing comes from another host, and only for who is signed in."""

import re

import httpx
import pytest

from api.pages.rest_calls import calls_by_subject, descriptions, kind_in_words


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


def test_a_call_says_role_parameters_body_and_answers(browser_client: httpx.Client) -> None:
    document = browser_client.get("/openapi.json").json()
    calls = {
        f"{each.method} {each.path}": each for group in calls_by_subject(document).values() for each in group
    }
    fit = calls["POST /experiments/{experiment}/models"]
    assert (fit.role, fit.body_kind, fit.values[0].place) == ("operator", "FitRequest", "path")
    assert [(each.status, each.kind) for each in fit.answers] == [("202", "JobView")]
    assert "409" in fit.refusals
    assert calls["POST /sign-in"].role == ""
    upload = calls["POST /experiments/import"]
    assert [(each.name, each.file, each.required) for each in upload.fields] == [("file", True, True)]
    assert "FitRequest" in {each.name for each in descriptions(document)}


@pytest.mark.parametrize(
    ("schema", "words"),
    [
        ({"anyOf": [{"type": "number"}, {"type": "null"}]}, "number or null"),
        ({"type": "array", "items": {"$ref": "#/components/schemas/Part"}}, "list of Part"),
        ({"$ref": "#/components/schemas/Choice"}, "csv, mat"),
        ({"type": "array", "prefixItems": [{"type": "integer"}, {"type": "string"}]}, "[whole number, text]"),
        ({"type": "object", "additionalProperties": {"type": "boolean"}}, "object of true or false"),
        ({"type": "string", "format": "binary"}, "file"),
    ],
)
def test_a_schema_is_said_in_words(schema: dict, words: str) -> None:
    schemas = {"Part": {"properties": {}}, "Choice": {"enum": ["csv", "mat"]}}
    assert kind_in_words(schema, schemas) == words


def test_the_address_leads_to_the_rig_once_there_is_an_experiment(browser_client: httpx.Client) -> None:
    assert browser_client.get("/", follow_redirects=False).headers["location"] == "/pages/rig"
