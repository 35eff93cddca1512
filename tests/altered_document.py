"""Documents of settings altered in one or two places, as a slip of the pen, another program or somebody's ill will does it."""

import copy
from typing import Any

from hypothesis import strategies as st

SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-(10**20), 10**20)
    | st.floats()
    | st.text(max_size=12)
    | st.sampled_from(
        [
            "",
            "..",
            "/etc/passwd",
            "1e400",
            "=1+1",
            "\u202e",
            "a" * 5000,
            "0x10",
            "12:30:00",
            "!!python/object:os.system",
        ]
    )
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=3),
    max_leaves=6,
)


def places(document: Any, place: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The way to every value within a document."""
    found = [place] if place else []
    items = (
        document.items()
        if isinstance(document, dict)
        else enumerate(document)
        if isinstance(document, list)
        else ()
    )
    for key, value in items:
        found += places(value, (*place, key))
    return found


@st.composite
def altered(draw: st.DrawFn, document: Any) -> Any:
    """The document with a value replaced, removed, doubled, or a key that is not known, once or twice."""
    made = copy.deepcopy(document)
    for _ in range(draw(st.integers(1, 2))):
        known = places(made)
        if not known:
            break
        *way, last = draw(st.sampled_from(known))
        inside = made
        for key in way:
            inside = inside[key]
        how = draw(st.sampled_from(["replace", "replace", "remove", "add"]))
        if how == "replace":
            inside[last] = draw(VALUES)
        elif how == "remove":
            del inside[last]
        elif isinstance(inside, dict):
            inside[draw(st.text(min_size=1, max_size=8))] = draw(VALUES)
        else:
            inside.append(copy.deepcopy(inside[last]))
    return made
