"""What a request's body says: a field that a call does not know is refused, for it would not do what it says."""

from pydantic import BaseModel, ConfigDict


class RequestDocument(BaseModel):
    """The body of a request, or a part of one."""

    model_config = ConfigDict(extra="forbid")
