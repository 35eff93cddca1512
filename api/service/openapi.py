"""The OpenAPI document: an example on every call, every error as a problem document, who may call what."""

from http import HTTPStatus
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from fastapi.params import Form
from fastapi.routing import APIRoute, iter_route_contexts
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from api.service.access import Viewer, declared_role
from api.service.problems import PROBLEM_MEDIA_TYPE, Problem, ProblemDocument
from identify.results.document import Json

EXAMPLES_OF_PATH = {
    "experiment": "rx130l-joint3",
    "session": "session-00",
    "recording": "session-00",
    "model": "m2",
    "ending": "urdf",
    "proof": "00",
    "drive": "without",
    "writing": "00",
    "job": "5f1c7a90b2d34e68",
    "rig": "rx130l-joint3-simulated",
    "plan": "joint3-sinusoids",
    "user": "ada",
    "token": "1d2c3b4a59687706",
}
"""What path parameters look like."""

WORDS_OF_PROBLEM = {
    400: "The body is not JSON.",
    401: "Sign in, or send a bearer token.",
    403: "This needs the role operator; ada asks as viewer.",
    404: "No experiment has the id `rx130l-joint9`.",
    405: "PATCH is not possible here.",
    409: "The job identify of this experiment is not done yet; wait or cancel it.",
    413: "The body is larger than 1048576 bytes.",
    415: "Send the body as application/json.",
    422: "body.payload.mass: Input should be greater than or equal to 0",
    429: "Too many attempts. Try again in 4 s.",
    507: "There is no room: the disk has 0.8 GB free.",
    503: "The rig does not answer: no CAN interface can0.",
}


def problems(*statuses: int) -> dict[int | str, Json]:
    """For a route's `responses`: the errors that its sort does not already imply."""
    return {status: {"description": HTTPStatus(status).phrase} for status in statuses}


class ResourceRoute(APIRoute):
    """A route that answers 415 where a body comes as something other than what it takes."""

    def get_route_handler(self):
        """The handler with the check in front."""
        handler = super().get_route_handler()
        if self.body_field is None:
            return handler
        accepted = (
            "multipart/form-data" if isinstance(self.body_field.field_info, Form) else "application/json"
        )

        optional = not self.body_field.field_info.is_required()

        async def checked(request: Request) -> Response:
            sent = request.headers.get("content-type", "").partition(";")[0].strip().lower()
            nothing = not sent and request.headers.get("content-length", "0") == "0"
            if sent != accepted and not (optional and nothing and "transfer-encoding" not in request.headers):
                raise Problem(415, f"Send the body as {accepted}.")
            return await handler(request)

        return checked


def install_openapi(application: FastAPI) -> None:
    """Let `application.openapi()` answer the completed document."""

    def openapi() -> Json:
        if application.openapi_schema is None:
            application.openapi_schema = _document(application)
        return application.openapi_schema

    application.openapi = openapi  # type: ignore[method-assign]
    application.add_api_route("/openapi.json", _answer, include_in_schema=False)


def _answer(request: Request, _user: Viewer) -> JSONResponse:
    # Not a function within the other: FastAPI keeps every endpoint that it has seen, and the application with it.
    return JSONResponse(request.app.openapi())


def _document(application: FastAPI) -> Json:
    document = get_openapi(
        title=application.title,
        version=application.version,
        description=application.description,
        routes=application.routes,
    )
    schemas = document.setdefault("components", {}).setdefault("schemas", {})
    schemas.pop("HTTPValidationError", None)
    schemas.pop("ValidationError", None)
    problem_schema = ProblemDocument.model_json_schema(ref_template="#/components/schemas/{model}")
    schemas.update(problem_schema.pop("$defs", {}))
    schemas["ProblemDocument"] = problem_schema
    document["components"]["securitySchemes"] = {
        "bearer": {"type": "http", "scheme": "bearer", "description": "a token of POST /tokens"},
        "cookie": {
            "type": "apiKey",
            "in": "cookie",
            "name": "coulomb",
            "description": "set by POST /sign-in",
        },
    }
    for route in iter_route_contexts(application.routes):
        if isinstance(route.original_route, APIRoute) and route.include_in_schema:
            for method in route.methods or ():
                operation = document["paths"][route.path_format][method.lower()]
                _complete(operation, method, declared_role(route), schemas)
    return document


def _complete(operation: Json, method: str, role: Any, schemas: Json) -> None:
    """Give one operation its problems, its security and its examples."""
    if role is not None:
        operation["security"] = [{"bearer": []}, {"cookie": []}]
        operation["description"] = f"{operation.get('description', '')}\n\nNeeds the role {role}.".strip()
    responses = operation["responses"]
    responses.pop("422", None) if "422" in responses and "content" in responses["422"] else None
    for status in _implied_problems(operation, method, role):
        responses.setdefault(str(status), {"description": HTTPStatus(status).phrase})
    for parameter in operation.get("parameters", []):
        if parameter["in"] == "path":
            parameter["example"] = EXAMPLES_OF_PATH[parameter["name"]]
    for content in operation.get("requestBody", {}).get("content", {}).values():
        content.setdefault("example", example_of(content["schema"], schemas))
    for status, response in responses.items():
        if int(status) >= 400:
            detail = WORDS_OF_PROBLEM.get(int(status), HTTPStatus(int(status)).phrase)
            example = {"type": "about:blank", "title": HTTPStatus(int(status)).phrase, "status": int(status)}
            response["content"] = {
                PROBLEM_MEDIA_TYPE: {
                    "schema": {"$ref": "#/components/schemas/ProblemDocument"},
                    "example": {**example, "detail": detail, "instance": "/"},
                }
            }
            continue
        for media_type, content in response.get("content", {}).items():
            if media_type == "application/json":
                content.setdefault("example", example_of(content.get("schema", {}), schemas))


def _implied_problems(operation: Json, method: str, role: Any) -> list[int]:
    """Errors that a call of this sort may always answer."""
    implied = [400]  # a foreign host name
    if role is not None:
        implied += [401, 403, 503]  # files may be read in a process, and there may be none free
    elif method not in ("GET", "HEAD"):
        implied += [403]
    if any(parameter["in"] == "path" for parameter in operation.get("parameters", [])):
        implied += [404, 422]
    if operation.get("parameters"):
        implied += [422]
    if method not in ("GET", "HEAD"):
        implied += [413, 429]
    if "requestBody" in operation:
        implied += [415, 422]
    return implied


def example_of(schema: Json, schemas: Json) -> Any:
    """An example of a JSON schema, from the examples of its fields."""
    if "$ref" in schema:
        return example_of(schemas[schema["$ref"].rpartition("/")[2]], schemas)
    if schema.get("examples"):
        return schema["examples"][0]
    for key in ("example", "const", "default"):
        if key in schema and schema[key] is not None:
            return schema[key]
    for key in ("anyOf", "oneOf", "allOf"):
        if key in schema:
            return example_of(schema[key][0], schemas)
    if "enum" in schema:
        return schema["enum"][0]
    kind = schema.get("type")
    if kind == "object":
        return {name: example_of(field, schemas) for name, field in schema.get("properties", {}).items()}
    if kind == "array":
        if "prefixItems" in schema:
            return [example_of(item, schemas) for item in schema["prefixItems"]]
        return [example_of(schema["items"], schemas)] if "items" in schema else []
    if schema.get("format") == "binary" or "contentMediaType" in schema:
        return "(the file)"
    return {"string": "text", "number": 0.0, "integer": 0, "boolean": True}.get(kind or "")
