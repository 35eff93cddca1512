"""Object dictionaries from EDS and DCF files: those of `config/drives/` by name, any other by path."""

from importlib.resources import as_file, files
from pathlib import Path

import canopen

from drivers.errors import DriverError


class ObjectDictionaryError(DriverError):
    """An EDS or DCF file is missing or cannot be read; one line that names it."""


def load_object_dictionary(name_or_path: str | Path, node: int) -> canopen.ObjectDictionary:
    """The object dictionary of a drive with $NODEID replaced by `node`.

    name_or_path : a file of `config/drives/` such as generic-cia402.eds, or a path to an EDS or DCF file

    Raises ObjectDictionaryError when there is no such file or it is not an EDS.
    """
    path = Path(name_or_path)
    if path.is_file():
        return _read(path, node)
    resource = files("config") / "drives" / str(name_or_path)
    if path.name != str(name_or_path) or not resource.is_file():
        raise ObjectDictionaryError(f"object dictionary {str(name_or_path)!r}: there is no such file")
    with as_file(resource) as found:
        return _read(found, node)


def _read(path: Path, node: int) -> canopen.ObjectDictionary:
    try:
        dictionary = canopen.import_od(str(path), node)
    except Exception as error:  # canopen lets configparser's, struct's and its own errors through
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ObjectDictionaryError(f"{path}: not a readable EDS or DCF: {reason}") from error
    if 0x1000 not in dictionary:
        raise ObjectDictionaryError(f"{path}: object 0x1000 (device type) is missing; is this an EDS?")
    return dictionary
