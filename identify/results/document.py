"""What all documents share: frozen, complete, no unknown keys, one form in JSON."""

import json
import math
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

FORMAT = 2
"""of the documents written now; 1 are those without a `format`, written before documents had types"""


def finite(value: Any) -> Any:
    """None for a number that is not finite: JSON has no other way to say that a figure cannot be given."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


Json = dict[str, Any]
"""A document as plain values. Any: JSON values nest freely, and whoever reads one validates it into its type first."""

Figure = Annotated[float | None, BeforeValidator(finite)]
"""A figure; None where it cannot be given, never left out and never invented."""


class Part(BaseModel):
    """A part of a document. Schemas are built when the first one is made, so that importing costs next to nothing."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True, defer_build=True)

    def to_json(self) -> Json:
        """As plain values, keys as in the contract."""
        return self.model_dump(mode="json", by_alias=True)

    def changed(self, **fields: object) -> Self:
        """The same with some fields replaced, checked."""
        return type(self).model_validate({**dict(self), **fields})


class Document(Part):
    """A whole document, with the version of its form."""

    MADE_BY: ClassVar[str]
    """the command that prints it"""

    format: Literal[2] = Field(default=FORMAT, description="version of this document's form")

    def json_text(self, indent: int | None = None) -> str:
        """As JSON."""
        return json.dumps(self.to_json(), ensure_ascii=False, allow_nan=False, indent=indent)
