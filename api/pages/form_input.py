"""What a person types into a form: read, and refused in one sentence."""

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager

from api.service.model_use import MOST_HORIZONS
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


def typed_horizons(typed: str) -> tuple[float, ...]:
    """Times ahead in s as people type them, between commas, semicolons or spaces. Raises the problem 422."""
    parts = re.split(r"[\s,;]+", typed.strip(" ,;"))
    if len(parts) > MOST_HORIZONS:
        raise Problem(422, f"These are {len(parts)} times ahead; enter at most {MOST_HORIZONS}.")
    horizons: list[float] = []
    for part in parts:
        try:
            seconds = float(part)
        except ValueError:
            seconds = math.nan
        if not (math.isfinite(seconds) and seconds > 0.0):
            raise Problem(
                422,
                f"“{part}” is not a time ahead; enter seconds above zero, with a decimal point, such as 0.1, 1.",
            )
        horizons.append(seconds)
    return tuple(horizons)
