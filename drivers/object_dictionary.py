"""Object dictionaries from EDS and DCF files: those of `config/drives/` by name, any other by path."""

from importlib.resources import as_file, files
from pathlib import Path

import canopen

from drivers.eds import ReadDictionary, read_eds
from drivers.errors import DriverError

GENERIC_DICTIONARY = "generic-cia402.eds"
"""What a drive is driven by where no file of its own can be read: the profile names the objects that matter."""


class ObjectDictionaryError(DriverError):
    """An EDS or DCF file is missing or cannot be read; one line that names it."""


def load_object_dictionary(name_or_path: str | Path, node: int) -> canopen.ObjectDictionary:
    """The object dictionary of a drive with $NODEID replaced by `node`.

    name_or_path : a file of `config/drives/` such as generic-cia402.eds, or a path to an EDS or DCF file

    Raises ObjectDictionaryError when there is no such file or it is not an EDS.
    """
    return read_object_dictionary(name_or_path, node).dictionary


def read_object_dictionary(name_or_path: str | Path, node: int) -> ReadDictionary:
    """The same, with what was passed over in the file, in words.

    Raises ObjectDictionaryError likewise.
    """
    path = Path(name_or_path)
    if path.is_file():
        return _read(path, node)
    resource = files("config") / "drives" / str(name_or_path)
    if path.name != str(name_or_path) or not resource.is_file():
        raise ObjectDictionaryError(f"object dictionary {str(name_or_path)!r}: there is no such file")
    with as_file(resource) as file:
        return _read(file, node)


def dictionary_to_drive_by(name_or_path: str | Path, node: int) -> ReadDictionary:
    """The dictionary of a file that is there but may be no EDS at all: then the generic one, and that is said.

    Raises ObjectDictionaryError when there is no such file.
    """
    try:
        return read_object_dictionary(name_or_path, node)
    except ObjectDictionaryError as error:
        if not Path(name_or_path).is_file():
            raise
        generic = read_object_dictionary(GENERIC_DICTIONARY, node)
        return ReadDictionary(
            generic.dictionary, [f"all of it ({error}); the profile alone says what is driven"]
        )


def _read(path: Path, node: int) -> ReadDictionary:
    try:
        read = read_eds(path, node)
    except OSError as error:
        raise ObjectDictionaryError(f"{path}: cannot be read: {error.strerror}") from error
    if not len(read.dictionary):
        raise ObjectDictionaryError(f"{path}: holds no object; is this an EDS or DCF?")
    return read
