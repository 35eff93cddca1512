"""The numbers that figures and tables of a fit are made of, kept beside the fit: it never changes once it is stored.

    models/m2/f1/shown/errors-0f3c….json      computed once, by whoever needs it first; a page then reads no samples

Figures are drawn anew for every page from these numbers, so that what is kept never holds an old drawing. A file that is
missing, was damaged or has another form is computed and written again; where it cannot be written, the page does without.
"""

import hashlib
import json
import logging
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Generic, TypeVar

import numpy as np
from pydantic import BaseModel, PlainSerializer, PlainValidator, TypeAdapter, ValidationError

from api.pages.lru_cache import LruCache

FORM = 4
"""of these files; whoever computes other numbers, or the same ones otherwise, raises it, and all are made again"""
FOLDER = "shown"
"""in the folder of a fit"""
DIGITS = 7
"""significant ones that are kept: no figure shows more"""
_log = logging.getLogger(__name__)


def _plain(values: Any) -> Any:
    """Nested lists of an array; None stands for what is not finite."""
    if isinstance(values, list):
        return [_plain(each) for each in values]
    if isinstance(values, float):
        return float(f"{values:.{DIGITS}g}") if np.isfinite(values) else None
    return values


def _array(values: Any) -> np.ndarray:
    """An array of such lists; whole numbers stay whole."""
    array = np.asarray(values)
    return array if array.dtype.kind in "iuf" else np.array(values, dtype=float)


Numbers = Annotated[
    np.ndarray, PlainValidator(_array), PlainSerializer(lambda array: _plain(np.asarray(array).tolist()))
]
"""An array that can be kept."""

Kind = TypeVar("Kind")


class _Kept(BaseModel):
    """A file: of what the numbers are, and the numbers, whose form their kind says."""

    of: str
    numbers: Any


class KeptNumbers(Generic[Kind]):
    """Numbers of one kind, of any fit.

    name : begins the names of their files
    kind : a dataclass of plain values and `Numbers`, or a list or a dictionary of such
    """

    def __init__(self, name: str, kind: Any) -> None:
        self._name = name
        self._adapter: TypeAdapter[Kind] = TypeAdapter(kind)
        self._held: LruCache[Kind] = LruCache(128)

    def of(self, fit: Path, key: object, make: Callable[[], Kind]) -> Kind:
        """Those kept in the folder of a fit, else what `make()` computes, which is kept.

        key : plain values that say of what they are; anything that changes them is a part of it
        """
        text = json.dumps([FORM, key], sort_keys=True)
        file = fit / FOLDER / f"{self._name}-{hashlib.sha256(text.encode()).hexdigest()[:16]}.json"

        def read_or_made() -> Kind:
            kept = self._read(file, text)
            return self._made(file, text, make) if kept is None else kept

        return self._held.get(file, read_or_made)

    def _read(self, file: Path, text: str) -> Kind | None:
        try:
            kept = _Kept.model_validate_json(file.read_bytes())
            return self._adapter.validate_python(kept.numbers) if kept.of == text else None
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError, LookupError, ValidationError) as error:
            _log.warning("%s is computed again: %s", file, " ".join(str(error).split()))
            return None

    def _made(self, file: Path, text: str, make: Callable[[], Kind]) -> Kind:
        plain = self._adapter.dump_python(make(), mode="json")
        try:
            file.parent.mkdir(exist_ok=True)
            # Not waited for until it is on disk: after a power failure it is computed again.
            unfinished = file.with_name(f".{file.name}.{secrets.token_hex(4)}")
            unfinished.write_text(json.dumps({"of": text, "numbers": plain}, separators=(",", ":")))
            unfinished.replace(file)
        except OSError as error:  # a full disk, a folder that is only read: a page shows it all the same
            _log.warning("%s was not kept: %s", file, error)
        # As it will be read the next time: a figure is the same whoever asks for it first.
        return self._adapter.validate_python(plain)
