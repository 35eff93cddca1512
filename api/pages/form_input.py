"""What a person types into a form: read, and refused in one sentence."""

from collections.abc import Iterator
from contextlib import contextmanager

from api.service.problems import Problem
from identify.recording.errors import InputError


@contextmanager
def input_errors_as_problems() -> Iterator[None]:
    """What a person typed wrongly becomes one sentence on the page."""
    try:
        yield
    except InputError as error:
        sentence = str(error)
        # A sentence begins with a capital, the name of a file as it is written.
        named = "." in sentence.partition(" ")[0]
        raise Problem(422, f"{sentence if named else sentence[:1].upper() + sentence[1:]}.") from error


def typed_mass(typed: str) -> float:
    """A mass as people type it, also with a comma. Raises the problem 422."""
    try:
        mass = float(typed.strip().replace(",", "."))
    except ValueError:
        raise Problem(422, f"“{typed}” is not a mass; enter it in kg, such as 3.458.") from None
    if not 0 <= mass <= 1e5:
        raise Problem(
            422,
            f"{typed.replace('-', '−')} kg is not a possible mass; enter what the scale shows, from 0 to 100 000 kg.",
        )
    return mass
