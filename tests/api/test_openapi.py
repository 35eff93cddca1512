"""The OpenAPI document says what the service does, with an example on every call."""

import json

import pytest
from jsonschema_rs import validator_for

from api.service.accounts import Role
from api.service.text_forms import WORDS

METHODS = ("get", "put", "post", "delete", "patch")


@pytest.fixture
def document(service):
    return service.client(Role.VIEWER).get("/openapi.json").json()


def operations(document):
    for path, item in document["paths"].items():
        for method in METHODS:
            if method in item:
                yield f"{method.upper()} {path}", item[method]


def test_every_call_has_an_example_of_what_is_sent_and_of_what_comes_back(document):
    without = []
    for name, operation in operations(document):
        for content in operation.get("requestBody", {}).get("content", {}).values():
            if content.get("example") in (None, {}):
                without.append(f"{name}: body")
        for parameter in operation.get("parameters", []):
            if parameter["in"] == "path" and "example" not in parameter:
                without.append(f"{name}: {parameter['name']}")
        for status, answer in operation["responses"].items():
            for content in answer.get("content", {}).values():
                if "example" not in content:
                    without.append(f"{name}: {status}")
    assert not without


def test_every_example_is_valid_by_its_own_schema(document):
    wrong = []

    def check(name, content):
        schema = dict(content["schema"]) | {"components": document["components"]}
        if schema.get("format") == "binary":
            return
        errors = [error.message for error in validator_for(schema).iter_errors(content["example"])]
        wrong.extend(f"{name}: {message}" for message in errors)

    for name, operation in operations(document):
        for kind, content in operation.get("requestBody", {}).get("content", {}).items():
            if kind == "application/json":
                check(f"{name}: body", content)
        for status, answer in operation["responses"].items():
            for kind, content in answer.get("content", {}).items():
                if kind.endswith("json"):
                    check(f"{name}: {status}", content)
    assert not wrong


def test_every_error_is_documented_as_a_problem_document(document):
    kinds = {
        (name, status): list(answer["content"])
        for name, operation in operations(document)
        for status, answer in operation["responses"].items()
        if int(status) >= 400
    }
    assert kinds
    assert {json.dumps(kind) for kind in kinds.values()} == {'["application/problem+json"]'}


def test_every_call_says_in_words_what_it_does_and_who_may_make_it(document):
    for name, operation in operations(document):
        assert len(operation["description"]) > 10, name
        if name != "POST /sign-in":
            assert "Needs the role" in operation["description"], name
            assert operation["security"], name


def patterns(part):
    if isinstance(part, dict):
        yield from (value for key, value in part.items() if key == "pattern" and isinstance(value, str))
        part = list(part.values())
    if isinstance(part, list):
        for each in part:
            yield from patterns(each)


def test_every_pattern_of_a_request_has_words_that_say_what_would_be_right(document):
    asked = [
        operation.get(key, [])
        for _, operation in operations(document)
        for key in ("parameters", "requestBody")
    ]
    asked.append(document["components"]["schemas"])
    assert set(patterns(asked)) - set(WORDS) == set()
    assert len(set(patterns(asked))) > 5


def schemas_of_bodies(document):
    """(call, name of the schema) of every JSON body, and of the parts it is made of."""

    def parts(schema):
        if isinstance(schema, dict):
            if "$ref" in schema:
                yield schema["$ref"].rpartition("/")[2]
            for each in schema.values():
                yield from parts(each)
        elif isinstance(schema, list):
            for each in schema:
                yield from parts(each)

    for name, operation in operations(document):
        content = operation.get("requestBody", {}).get("content", {}).get("application/json")
        waiting, seen = list(parts(content)), set()
        while waiting:
            schema = waiting.pop()
            if schema in seen:
                continue
            seen.add(schema)
            yield name, schema
            waiting += parts(document["components"]["schemas"][schema])


def test_no_body_takes_a_field_that_it_does_not_know(document):
    open_ones = [
        f"{name}: {schema}"
        for name, schema in schemas_of_bodies(document)
        if document["components"]["schemas"][schema].get("type") == "object"
        and document["components"]["schemas"][schema].get("additionalProperties") is not False
    ]
    assert open_ones == []
    assert len(set(schemas_of_bodies(document))) > 15


@pytest.mark.parametrize(
    ("method", "address", "body"),
    [
        ("post", "/experiments", {"name": "arm", "rig": "rx130l-joint3-simulated"}),
        ("post", "/plans", {"rig": "rx130l-joint3-simulated", "name": "plan"}),
        ("post", "/sign-in", {"name": "ada", "password": "correct horse battery"}),
    ],
)
def test_an_unknown_field_is_refused_in_one_line_that_names_it(service, method, address, body):
    client = service.client(Role.OPERATOR)
    answer = client.request(method, address, json=body | {"secnods": 20})
    assert answer.status_code == 422, answer.text
    detail = answer.json()["detail"]
    assert detail.startswith("body.secnods: is no field of this request")
    assert "\n" not in detail
