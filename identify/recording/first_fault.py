"""What pydantic finds wrong, in one line of ours."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from pydantic import ValidationError


class Fault(NamedTuple):
    """One thing that is wrong: `place`, names of fields and numbers of items from the outside in, and the mistake there."""

    place: tuple[str | int, ...]
    mistake: str


def fault_of(error: ValidationError) -> Fault:
    """The first fault; of a text that is no JSON it has no place."""
    fault = error.errors(include_url=False)[0]
    return Fault(fault["loc"], fault["msg"].removeprefix("Value error, "))


def first_fault(error: ValidationError, *above: str) -> str:
    """The first fault: the path of its field and what is wrong with it; of a text that is no JSON there is no field.

    above : names of the sections that the checked values stand in
    """
    place, mistake = fault_of(error)
    field = ".".join(str(part) for part in (*above, *place))
    return f"{field}: {mistake}" if field else mistake
