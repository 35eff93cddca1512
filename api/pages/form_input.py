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
        words = str(error)
        # A sentence begins with a capital, the name of a file as it is written.
        named = "." in words.partition(" ")[0]
        raise Problem(422, f"{words if named else words[:1].upper() + words[1:]}.") from error


def typed_mass(words: str) -> float:
    """A mass as people type it, also with a comma. Raises the problem 422."""
    try:
        mass = float(words.strip().replace(",", "."))
    except ValueError:
        raise Problem(422, f"“{words}” is not a mass; type it in kg, such as 3.458.") from None
    if not 0 <= mass <= 1e5:
        raise Problem(422, f"A mass of {words} kg cannot be; type what the scale says, in kg.")
    return mass
