"""Documents read from files, those of older versions of the software included.

Every document carries the version of its form, `format`; documents written before they had one count as format 1. A
document of an older form is brought to the present one, step by step, before it is checked; one of a newer form is
refused. Whoever changes a form raises `FORMAT`, adds a step to `STEPS`, and keeps files of the old form as test cases.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast

from pydantic import BeforeValidator, ValidationError

from identify.recording.errors import InputError
from identify.recording.first_fault import first_fault
from identify.results.document import FORMAT, Document, Json
from identify.results.next_experiment import NextExperimentDocument

Kind = TypeVar("Kind", bound=Document)


def read_document(kind: type[Kind], file: Path) -> Kind:
    """The document in a file.

    Raises InputError: it is not such a document, or was written by a newer version; names file and field.
    Raises FileNotFoundError: there is no such file.
    """
    return document_from_json(kind, file.read_bytes(), str(file))


def read_named_document(kind: type[Kind], file: Path) -> Kind:
    """The document in a file that a person named.

    Raises InputError: as `read_document`, or the file cannot be read.
    """
    try:
        return read_document(kind, file)
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None


def document_from_json(kind: type[Kind], content: str | bytes, source: str) -> Kind:
    """The document in a text; `source` says in errors where the text came from.

    Raises InputError: see `read_document`.
    """
    try:
        values = json.loads(content)
    except json.JSONDecodeError as error:
        raise InputError(f"{source}, line {error.lineno}: not JSON ({error.msg})") from None
    except UnicodeDecodeError:
        raise InputError(f"{source}: not JSON (its bytes are no text)") from None
    except (ValueError, RecursionError):
        raise InputError(
            f"{source}: no result: lists too deep within each other, or a number of too many digits"
        ) from None
    return document_of(kind, values, source)


def document_of(kind: type[Kind], values: object, source: str) -> Kind:
    """The document that plain values make.

    Raises InputError: see `read_document`.
    """
    if not isinstance(values, dict):
        raise InputError(f"{source}: not a result of `{kind.MADE_BY}`; that is an object with named fields")
    fields = cast(Json, values)
    form = fields.get("format", 1)
    if type(form) is not int or not 1 <= form <= FORMAT:
        raise InputError(
            f"{source}: format: {form!r} is unknown; this version reads formats 1 to {FORMAT}: "
            "the document was damaged, or a newer version wrote it"
        )
    for step in range(form, FORMAT):
        fields = {**STEPS[step](kind, fields), "format": step + 1}
    try:
        return kind.model_validate(fields)
    except ValidationError as error:
        raise InputError(f"{source}: not a result of `{kind.MADE_BY}`: {first_fault(error)}") from None


def of_any_version(kind: type[Document]) -> BeforeValidator:
    """For a field that holds a whole document: plain values of an older form are read too.

    Validation raises InputError: see `read_document`.
    """

    def read(values: object) -> object:
        return (
            values if values is None or isinstance(values, kind) else document_of(kind, values, kind.MADE_BY)
        )

    return BeforeValidator(read)


def _from_format_1(kind: type[Document], values: Json) -> Json:
    """Fields without a value were left out of some documents; where nothing was left to separate, `next` was stored
    with four of its fields."""
    if kind is NextExperimentDocument:
        left_out: Json = {"experiment": None, "separation_so_far": None, "posture": []}
        return left_out | values
    return values


STEPS: dict[int, Callable[[type[Document], Json], Json]] = {1: _from_format_1}
"""By format what makes the next one of it."""
