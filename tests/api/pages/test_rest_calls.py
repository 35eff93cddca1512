"""The OpenAPI document as calls that a person reads."""

import httpx
import pytest

from api.pages.rest_calls import calls_by_subject, descriptions, kind_in_words


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
    ("schema", "kind"),
    [
        ({"anyOf": [{"type": "number"}, {"type": "null"}]}, "number or null"),
        ({"type": "array", "items": {"$ref": "#/components/schemas/Part"}}, "list of Part"),
        ({"$ref": "#/components/schemas/Choice"}, "csv, mat"),
        ({"type": "array", "prefixItems": [{"type": "integer"}, {"type": "string"}]}, "[whole number, text]"),
        ({"type": "object", "additionalProperties": {"type": "boolean"}}, "object of true or false"),
        ({"type": "string", "format": "binary"}, "file"),
    ],
)
def test_a_schema_is_said_in_words(schema: dict, kind: str) -> None:
    schemas = {"Part": {"properties": {}}, "Choice": {"enum": ["csv", "mat"]}}
    assert kind_in_words(schema, schemas) == kind
