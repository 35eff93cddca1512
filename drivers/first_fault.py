"""What pydantic finds wrong, in one line of ours.

`identify.recording.first_fault` says the same of an experiment's files; neither room knows the other.
"""

from pydantic import ValidationError


def first_fault(error: ValidationError, *above: str) -> str:
    """The first fault: the path of its field and what is wrong with it.

    above : names of the sections that the checked values stand in
    """
    fault = error.errors(include_url=False)[0]
    field = ".".join(str(part) for part in (*above, *fault["loc"]))
    mistake = fault["msg"].removeprefix("Value error, ")
    return f"{field}: {mistake}" if field else mistake
