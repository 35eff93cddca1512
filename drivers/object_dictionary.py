"""Object dictionaries from EDS and DCF files: those of `config/drives/` by name, any other by path."""

from functools import lru_cache
from importlib.resources import as_file, files
from importlib.resources.abc import Traversable
from pathlib import Path

import canopen

from drivers.eds import ReadDictionary, read_eds
from drivers.errors import DriverError


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
    if _is_own(path):
        state = path.stat()
        return _read_once(path, node, state.st_mtime_ns, state.st_size)
    with as_file(_resource(name_or_path)) as file:
        return _read(file, node)


def _is_own(path: Path) -> bool:
    """Whether a file is a user's own: a bare name that comes with the software means that one, wherever the command is run."""
    named_alone = path.name == str(path) and (files("config") / "drives" / path.name).is_file()
    return not named_alone and path.is_file()


def _resource(name_or_path: str | Path) -> Traversable:
    """A file that comes with the software, by its name."""
    resource = files("config") / "drives" / str(name_or_path)
    if Path(name_or_path).name != str(name_or_path) or not resource.is_file():
        raise ObjectDictionaryError(f"object dictionary {str(name_or_path)!r}: there is no such file")
    return resource


def own_dictionary(name_or_path: str | Path, node: int) -> canopen.ObjectDictionary | None:
    """What a drive's own EDS says; None for the files that come with the software, and for one that cannot be read."""
    if not _is_own(Path(name_or_path)):
        return None
    try:
        return read_object_dictionary(name_or_path, node).dictionary
    except ObjectDictionaryError:
        return None


def passed_over(name_or_path: str | Path, node: int) -> tuple[str, ...]:
    """What of a drive's own EDS could not be read, in words; a file that is no EDS at all leaves everything to the profile.

    Nothing of the files that come with the software. Raises ObjectDictionaryError when there is no such file.
    """
    if not _is_own(Path(name_or_path)):
        _resource(name_or_path)
        return ()
    try:
        return tuple(read_object_dictionary(name_or_path, node).passed_over)
    except ObjectDictionaryError as error:
        return (f"all of it ({error}); the profile alone says what is driven",)


@lru_cache(maxsize=32)
def _read_once(path: Path, node: int, _changed: int, _size: int) -> ReadDictionary:
    """A rig file is read often, and names the file once for each axis."""
    return _read(path, node)


def _read(path: Path, node: int) -> ReadDictionary:
    try:
        read = read_eds(path, node)
    except OSError as error:
        raise ObjectDictionaryError(f"{path}: cannot be read: {error.strerror}") from error
    if not len(read.dictionary):
        raise ObjectDictionaryError(f"{path}: holds no object; is this an EDS or DCF?")
    return read
