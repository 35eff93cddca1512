"""What a session carried: a payload as its experiment declares it, or as much of one as a file of anybody's says."""

from typing import cast

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload


class UndescribedPayload(BaseModel):
    """A payload of which the file says the name at most."""

    model_config = ConfigDict(frozen=True)

    name: str = Field(default="unknown", examples=["disk"])
    mass: None = Field(default=None, description="not known")


SessionPayload = Payload | UndescribedPayload


def session_payload(stated: object) -> SessionPayload:
    """The payload that plain values state, such as a recording's attribute `payload`; what they do not state is not known."""
    try:
        return Payload.model_validate(stated)
    except ValidationError:
        name = cast(dict[object, object], stated).get("name") if isinstance(stated, dict) else None
        return UndescribedPayload(name=name) if isinstance(name, str) else UndescribedPayload()


def described(payload: SessionPayload) -> Payload:
    """The payload itself, as whoever drives or predicts a session needs it. Raises InputError where its file did not say it."""
    if isinstance(payload, UndescribedPayload):
        raise InputError(f"payload: the mass of {payload.name} is not known; prepare a new session")
    return payload
