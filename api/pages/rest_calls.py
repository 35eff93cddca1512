"""The calls of an OpenAPI document as a person reads them: what is sent, what is answered, who may ask."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from http import HTTPStatus

from identify.results.document import Json

KINDS = {
    "string": "text",
    "number": "number",
    "integer": "whole number",
    "boolean": "true or false",
    "null": "null",
}
"""JSON's own types in words."""
MOST_CHOICES = 12
"""Values of an enumeration that are listed; of more the first are."""


@dataclass(frozen=True)
class Value:
    """One parameter, or one field of a document."""

    name: str
    kind: str
    """In words; the name of a document where it is one."""
    required: bool
    words: str
    example: str = ""
    place: str = ""
    """`path` or `query`; nothing for a field."""
    file: bool = False


@dataclass(frozen=True)
class Answer:
    """One answer of a call that was not refused."""

    status: str
    words: str
    kind: str
    example: str


@dataclass(frozen=True)
class Call:
    """One method on one address."""

    method: str
    path: str
    anchor: str
    words: tuple[str, ...]
    """Paragraphs; the first says what the call does."""
    role: str
    """Who may ask: the least role, or nothing where nobody need be signed in."""
    values: tuple[Value, ...]
    media_type: str
    """Of the body; nothing where there is none."""
    body_kind: str
    body_example: str
    fields: tuple[Value, ...]
    """Fields of a form; none where the body is JSON."""
    answers: tuple[Answer, ...]
    refusals: str
    """Status codes with which it may be refused."""


@dataclass(frozen=True)
class Description:
    """A document that calls take or answer, with its fields."""

    name: str
    words: str
    fields: tuple[Value, ...]


def calls_by_subject(document: Json) -> dict[str, list[Call]]:
    """Subject (tag) -> its calls, in the document's order."""
    subjects: dict[str, list[Call]] = {}
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            subject = (operation.get("tags") or ["service"])[0]
            subjects.setdefault(subject, []).append(
                _call(method, path, operation, document["components"]["schemas"])
            )
    return subjects


def descriptions(document: Json) -> list[Description]:
    """Every document that has fields, by name."""
    schemas: Json = document["components"]["schemas"]
    return [
        Description(name, " ".join(schema.get("description", "").split()), tuple(_fields(schema, schemas)))
        for name, schema in sorted(schemas.items())
        if schema.get("properties") and not name.startswith("Body_")
    ]


def _call(method: str, path: str, operation: Json, schemas: Json) -> Call:
    paragraphs = [" ".join(each.split()) for each in operation.get("description", "").split("\n\n")]
    role = next((each for each in paragraphs if each.startswith("Needs the role ")), "")
    media_type, content = next(iter(operation.get("requestBody", {}).get("content", {}).items()), ("", {}))
    schema = content.get("schema", {})
    form = media_type == "multipart/form-data"
    responses = operation["responses"]
    return Call(
        method=method.upper(),
        path=path,
        anchor=operation["operationId"],
        words=tuple(each for each in paragraphs if each and each != role),
        role=role.removeprefix("Needs the role ").rstrip("."),
        values=tuple(_parameter(each, schemas) for each in operation.get("parameters", [])),
        media_type=media_type,
        body_kind="" if form else kind_in_words(schema, schemas),
        body_example="" if form or not content else _indented(content.get("example")),
        fields=tuple(_fields(_resolved(schema, schemas), schemas)) if form else (),
        answers=tuple(
            _answer(status, each, schemas) for status, each in responses.items() if int(status) < 400
        ),
        refusals=", ".join(sorted(status for status in responses if int(status) >= 400)),
    )


def _parameter(parameter: Json, schemas: Json) -> Value:
    schema = parameter["schema"]
    example = parameter.get("example", schema.get("default"))
    return Value(
        name=parameter["name"],
        kind=kind_in_words(schema, schemas),
        required=parameter.get("required", False),
        words=parameter.get("description") or schema.get("description", ""),
        example="" if example is None else str(example),
        place=parameter["in"],
    )


def _answer(status: str, response: Json, schemas: Json) -> Answer:
    media_type, content = next(iter(response.get("content", {}).items()), ("", {}))
    meaning = response.get("description", "")
    plain = meaning in ("", "Successful Response")
    schema = content.get("schema", {})
    json_kind = kind_in_words(schema, schemas) if media_type == "application/json" and schema else media_type
    return Answer(
        status=status,
        words=HTTPStatus(int(status)).phrase if plain else meaning,
        kind=json_kind,
        example=_indented(content["example"]) if "example" in content else "",
    )


def _fields(schema: Json, schemas: Json) -> Iterator[Value]:
    required = schema.get("required", [])
    for name, field in schema.get("properties", {}).items():
        kind = kind_in_words(field, schemas)
        yield Value(
            name=name,
            kind=kind,
            required=name in required,
            words=" ".join(field.get("description", "").split()),
            file=kind in ("file", "list of file"),
        )


def _resolved(schema: Json, schemas: Json) -> Json:
    if "$ref" in schema:
        return schemas[schema["$ref"].rpartition("/")[2]]
    return schema


def kind_in_words(schema: Json, schemas: Json) -> str:
    """What a JSON schema lets in, in a few words; a document by its name.

    schemas : name -> schema, of the OpenAPI document
    """
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return name if "properties" in schemas[name] else kind_in_words(schemas[name], schemas)
    for key in ("anyOf", "oneOf"):
        if key in schema:
            return " or ".join(dict.fromkeys(kind_in_words(each, schemas) for each in schema[key]))
    if "allOf" in schema:
        return kind_in_words(schema["allOf"][0], schemas)
    if "const" in schema:
        return json.dumps(schema["const"])
    if "enum" in schema:
        listed = [str(each) for each in schema["enum"][:MOST_CHOICES]]
        return ", ".join(listed) + (", …" if len(schema["enum"]) > MOST_CHOICES else "")
    kind = schema.get("type")
    if kind == "array":
        if "prefixItems" in schema:
            return f"[{', '.join(kind_in_words(each, schemas) for each in schema['prefixItems'])}]"
        return f"list of {kind_in_words(schema['items'], schemas)}" if "items" in schema else "list"
    if kind == "object":
        inner = schema.get("additionalProperties")
        return f"object of {kind_in_words(inner, schemas)}" if isinstance(inner, dict) and inner else "object"
    if schema.get("format") == "binary" or "contentMediaType" in schema:
        return "file"
    return KINDS.get(kind or "", "any value")


def _indented(example: object) -> str:
    return json.dumps(example, indent=2, ensure_ascii=False)
