"""A drive's profile compared with its EDS, before the bus is touched."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, cast

from canopen.objectdictionary import ObjectDictionary, ODVariable, datatypes

from drivers.eds import EdsVariable
from drivers.object_dictionary import own_dictionary
from drivers.profile import DriveProfile, ObjectReference

_TYPES = {
    "int8": datatypes.INTEGER8,
    "int16": datatypes.INTEGER16,
    "int32": datatypes.INTEGER32,
    "uint8": datatypes.UNSIGNED8,
    "uint16": datatypes.UNSIGNED16,
    "uint32": datatypes.UNSIGNED32,
    "float32": datatypes.REAL32,
}
_NAMES = {number: name for name, number in _TYPES.items()}


def mismatches(profile: DriveProfile, node: int) -> tuple[str, ...]:
    """Where a profile contradicts the EDS that it names: types, access, mapping; each in words with the remedy.

    Only what the EDS says is compared: an object that it does not list may be there all the same, a file that cannot be read
    says nothing, and one by which no object at all may be mapped says nothing of mapping. The dictionaries that come with the
    software are no drive's own and are not compared.
    """
    dictionary = own_dictionary(profile.object_dictionary, node)
    if dictionary is None:
        return ()
    says_mapping = any(variable.pdo_mappable for variable in _variables(dictionary))
    sentences: list[str] = []
    named = Path(profile.object_dictionary).name
    for role, reference, streamed in (
        ("position", profile.position, True),
        ("current_reference", profile.current_reference, True),
        ("rated", profile.rated, False),
        ("temperature", profile.temperature, True),
    ):
        variable = None if reference is None else dictionary.get_variable(reference.index, reference.subindex)
        if reference is None or variable is None:
            continue
        contradiction = _contradiction(reference, variable, streamed and says_mapping)
        if contradiction:
            sentences.append(
                f"{role} {reference} of the profile {profile.name}: {contradiction} in {named}; one of them is wrong"
            )
    return tuple(sentences)


def _variables(dictionary: ObjectDictionary) -> Iterator[ODVariable]:
    """All that a dictionary says of values."""
    for entry in cast("Iterable[Any]", dictionary.values()):  # pyright: ignore[reportUnknownMemberType]  untyped in canopen
        yield from (entry,) if isinstance(entry, ODVariable) else entry.values()


def _contradiction(reference: ObjectReference, variable: ODVariable, streamed: bool) -> str:
    kind = variable.data_type
    if kind is not None and kind in _NAMES and _NAMES[kind] != reference.type:
        return f"{reference.type}, but {_NAMES[kind]}"
    if variable.access_type == "wo":
        return "is read, but write-only"
    if streamed and not variable.pdo_mappable and isinstance(variable, EdsVariable) and variable.mapping_said:
        return "goes into a PDO, but may not be mapped"
    return ""
