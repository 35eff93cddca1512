"""Every error of the service as a problem document (RFC 9457, `application/problem+json`)."""

import logging
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ConfigDict, Field
from starlette.exceptions import HTTPException
from starlette.responses import JSONResponse, Response

from api.service.text_forms import words_of
from drivers.errors import DriverError
from identify.recording.errors import InputError

PROBLEM_MEDIA_TYPE = "application/problem+json"
_log = logging.getLogger(__name__)


class FieldProblem(BaseModel):
    """One field that is wrong."""

    where: str = Field(examples=["body.payload.mass"])
    what: str = Field(examples=["Input should be greater than or equal to 0"])


class ProblemDocument(BaseModel):
    """RFC 9457 problem details; `type` is `about:blank`, so `title` is the status in words."""

    model_config = ConfigDict(extra="allow")

    type: str = Field(default="about:blank", examples=["about:blank"])
    title: str = Field(examples=["Not Found"])
    status: int = Field(examples=[404])
    detail: str = Field(examples=["No experiment has the id `rx130l-joint9`."])
    instance: str | None = Field(default=None, examples=["/experiments/rx130l-joint9"])
    errors: list[FieldProblem] | None = None


class Problem(Exception):
    """A request cannot be answered as asked.

    status : HTTP status, 400 to 599
    detail : one sentence for the person who asked: what is wrong and what would be right
    headers: further response headers, such as Retry-After
    """

    def __init__(
        self, status: int, detail: str, headers: Mapping[str, str] | None = None, **extra: Any
    ) -> None:
        super().__init__(detail)
        self.status = status
        self.detail = detail
        self.headers = dict(headers or {})
        self.extra = extra


def problem_response(
    status: int, detail: str, instance: str, headers: Mapping[str, str] | None = None, **extra: Any
) -> JSONResponse:
    """The problem document as a response."""
    body = {
        "type": "about:blank",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
        "instance": instance,
        **extra,
    }
    return JSONResponse(body, status, headers=dict(headers or {}), media_type=PROBLEM_MEDIA_TYPE)


def not_found(kind: str, identifier: str) -> Problem:
    """The problem of an id that nothing has."""
    return Problem(404, f"No {kind} has the id `{identifier}`.")


async def problem_answer(request: Request, error: Problem) -> Response:
    """The response to a problem: a page for a browser, else the problem document. No path of this computer is in it."""
    hidden = request.app.state.service.settings.without_folders(error.detail)
    error = Problem(error.status, hidden, error.headers, **error.extra)
    page = getattr(request.app.state, "problem_page", None)
    if page is not None and "text/html" in request.headers.get("accept", ""):
        return page(request, error)
    return problem_response(error.status, error.detail, request.url.path, error.headers, **error.extra)


async def _http_error(request: Request, error: HTTPException) -> Response:
    detail = error.detail
    if error.status_code == 404 and detail == "Not Found":
        detail = "Nothing is at this address."
    elif error.status_code == 405:
        detail = f"{request.method} is not possible here."
    return await problem_answer(request, Problem(error.status_code, detail, error.headers))


def _what(fault: Mapping[str, Any]) -> str:
    """What is wrong with a field, in words: an expression says nothing to who typed the text."""
    match fault:
        case {"type": "string_pattern_mismatch", "ctx": {"pattern": str(pattern)}}:
            return words_of(pattern)
        case {"type": "extra_forbidden"}:
            return "is no field of this request; see /docs for those that are"
        case _:
            return fault["msg"]


async def _validation_error(request: Request, error: RequestValidationError) -> Response:
    faults = [(fault["loc"], _what(fault), fault["type"]) for fault in error.errors()]
    around = {place[:depth] for place, *_ in faults for depth in range(len(place))}
    fields = [
        FieldProblem(where=".".join(str(part) for part in place), what=what)
        for place, what, _ in faults
        if place not in around  # a list whose item is wrong says nothing more
    ]
    errors = [field.model_dump() for field in fields]
    if any(kind == "json_invalid" for *_, kind in faults):
        return problem_response(400, "The body is not JSON.", request.url.path, errors=errors)
    detail = "; ".join(f"{field.where}: {field.what}" for field in fields) or "The request is not valid."
    return await problem_answer(request, Problem(422, detail, errors=errors))


async def _input_error(request: Request, error: InputError) -> Response:
    return await problem_answer(request, Problem(422, str(error)))


async def _driver_error(request: Request, error: DriverError) -> Response:
    return await problem_answer(request, Problem(503, str(error)))


async def _unexpected(request: Request, error: Exception) -> Response:
    _log.error("%s %s failed", request.method, request.url.path, exc_info=error)
    detail = "The service failed to answer; its log says why. Nothing was moved by this request."
    return await problem_answer(request, Problem(500, detail))


def install_problem_handlers(application: FastAPI) -> None:
    """Let every error of `application` leave as a problem document."""
    handlers: dict[Any, Any] = {
        Problem: problem_answer,
        HTTPException: _http_error,
        RequestValidationError: _validation_error,
        InputError: _input_error,
        DriverError: _driver_error,
        Exception: _unexpected,
    }
    for kind, handler in handlers.items():
        application.add_exception_handler(kind, handler)
