"""MAT files of any version, and plain HDF5 files, as named columns: arrays, structs, tables, timetables, time series."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.recording.errors import InputError
from identify.recording.foreign.mat5 import DEEPEST, Damaged, Mat5, Reference
from identify.recording.foreign.matlab_objects import Fields, ObjectStore, as_fields, is_reference
from identify.recording.foreign.table import ForeignColumn, ForeignTable
from identify.recording.units import split_name, unit_of

NOT_MAT = (
    ValueError,
    TypeError,
    LookupError,
    NotImplementedError,
    EOFError,
    OverflowError,
    MemoryError,
    RecursionError,
)
"""What reading damaged files raises below us."""
LABELS = ("label", "Name", "name", "blockName", "BlockName")
_LEAST_BYTES = 64
"""Of a group or dataset in an HDF5 file: its header alone has more"""
UNITS = ("Unit", "unit", "Units", "units")
"""Fields of structs that say what their numbers are, and in which unit."""


def read_mat(path: Path) -> ForeignTable:
    """Read a MAT file of version 4 to 7.

    Raises InputError: it is damaged or holds no column of numbers.
    """
    try:
        content = path.read_bytes()
        if content[126:128] not in (b"IM", b"MI"):
            return table_of_variables(path, _variables_of_version_4(path))
        file = Mat5(content)
        variables = dict(file.variables())
        store = _store(_cells_of(file.subsystem())) if _refers(variables) else None
        return table_of_variables(path, dict(_flat(variables, store)))
    except Damaged as error:
        raise InputError(f"{path}: cannot be read as a MAT file: {error}; save or copy it again") from None
    except NOT_MAT:
        raise InputError(f"{path}: cannot be read as a MAT file: damaged; save or copy it again") from None


def _variables_of_version_4(path: Path) -> dict[str, NDArray[Any]]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError, matfile_version

    try:
        if matfile_version(path)[0] != 0:
            raise Damaged("no mark of a byte order")
        content = loadmat(path)
    except MatReadError:
        raise Damaged("cut short") from None
    return {
        name: value
        for name, value in content.items()
        if isinstance(value, np.ndarray) and value.dtype.kind in "biuf" and not name.startswith("__")
    }


def read_hdf5(path: Path) -> ForeignTable:
    """Read a MAT file of version 7.3, or any HDF5 file; MATLAB stores arrays transposed.

    Raises InputError: it is damaged or holds no column of numbers.
    """
    import h5py

    try:
        with h5py.File(path, "r") as file:
            values = _Hdf5Values(file, path.stat().st_size)
            variables = {
                values.named(name, file[name]): values.of(file[name])
                for name in file
                if name not in ("#refs#", "#subsystem#")
            }
            store = None
            if _refers(variables) and "#subsystem#" in file:
                cells = [values.of(file[each]) for each in np.ravel(file["#subsystem#/MCOS"][()])]  # type: ignore[index]
                store = _store(cells)
            return table_of_variables(path, dict(_flat(variables, store)))
    except Damaged as error:
        raise InputError(f"{path}: cannot be read as HDF5: {error}; save or copy it again") from None
    except (OSError, RuntimeError, AttributeError, *NOT_MAT):
        raise InputError(
            f"{path}: cannot be read as HDF5: damaged or cut short; save or copy it again"
        ) from None


class _Hdf5Values:
    """Values of an HDF5 file as `Mat5` gives them.

    Groups by links and datasets by references may stand in several others, so that a small file could unfold to any number of
    values. What is read again counts against the size of the file.
    """

    def __init__(self, file: Any, size: int) -> None:
        self._file = file
        self._seen: set[tuple[int, int]] = set()
        self._left = size

    def named(self, name: str, item: Any) -> str:
        """The name of a group or dataset, with the unit that an attribute states."""
        for key in UNITS:
            unit = item.attrs.get(key)
            text = unit.decode("utf-8", "replace") if isinstance(unit, bytes) else unit
            if isinstance(text, str) and unit_of(text) is not None:
                return f"{name} [{text}]"
        return name

    def of(self, item: Any, depth: int = 0) -> Any:
        """The value of a group or dataset. Raises Damaged: they hold each other again and again."""
        import h5py
        from h5py import h5o

        place = h5o.get_info(item.id)
        if (place.fileno, place.addr) in self._seen:
            self._left -= _LEAST_BYTES + (item.id.get_storage_size() if isinstance(item, h5py.Dataset) else 0)
        self._seen.add((place.fileno, place.addr))
        if depth > DEEPEST:
            raise Damaged("groups too deep")
        if self._left < 0:
            raise Damaged("its groups and cells hold each other again and again")
        kind = item.attrs.get("MATLAB_class", b"")
        if isinstance(item, h5py.Group):
            fields = {self.named(name, item[name]): self.of(item[name], depth + 1) for name in item}
            return _array_of_structs(fields) if _is_array_of_structs(item) else fields
        if "MATLAB_object_decode" in item.attrs and item.attrs["MATLAB_object_decode"] == 3:
            return Reference(bytes(kind).decode("utf-8", "replace"), item[()])
        if "ref" in (item.dtype.metadata or {}):
            return [self.of(self._file[each], depth + 1) for each in np.ravel(item[()]) if each]
        if item.attrs.get("MATLAB_empty"):
            return np.empty((0, 0))
        values = item[()]
        if isinstance(values, np.ndarray) and values.dtype.names:  # a table of records
            return {name: values[name] for name in values.dtype.names}
        if kind == b"char" and isinstance(values, np.ndarray):
            return "".join(chr(int(code)) for code in np.ravel(values))
        return values.T if isinstance(values, np.ndarray) else np.asarray(values)


def _is_array_of_structs(group: Any) -> bool:
    """Whether each field of a struct holds references, and these are no cells: one for each element of an array."""
    import h5py

    fields = [group[name] for name in group]
    return (
        bool(fields)
        and all(isinstance(each, h5py.Dataset) and "ref" in (each.dtype.metadata or {}) for each in fields)
        and not any(each.attrs.get("MATLAB_class") == b"cell" for each in fields)
        and len({each.size for each in fields}) == 1
    )


def _array_of_structs(fields: Fields) -> list[Fields]:
    count = max(map(len, fields.values()))
    return [
        {name: values[place] for name, values in fields.items() if place < len(values)}
        for place in range(count)
    ]


def _refers(variables: Mapping[str, Any]) -> bool:
    def within(value: Any) -> bool:
        if isinstance(value, dict):
            return any(map(within, value.values()))
        return any(map(within, value)) if isinstance(value, list) else isinstance(value, Reference)

    return within(dict(variables))


def _cells_of(subsystem: Any) -> list[Any]:
    content = subsystem.get("MCOS") if isinstance(subsystem, dict) else None
    inside = content.content if isinstance(content, Reference) else content
    return inside if isinstance(inside, list) else []


def _store(cells: list[Any]) -> ObjectStore | None:
    return ObjectStore(cells) if cells else None


def _flat(
    variables: Mapping[str, Any], store: ObjectStore | None, prefix: str = "", depth: int = 0
) -> Iterator[tuple[str, NDArray[Any]]]:
    """Numeric arrays by name; what is inside a struct, a table or an object as outer.inner."""
    if depth > DEEPEST:
        raise Damaged("objects too deep")
    for name, value in variables.items():
        if isinstance(value, list) and len(value) == 1:
            value = value[0]
        if store is not None and is_reference(value):
            value = Reference("", value)
        if isinstance(value, list) and value and all(isinstance(each, dict) for each in value):
            value = _by_label(value)
        elif isinstance(value, list):
            value = _by_name(value, store)
        if isinstance(value, np.ndarray):
            if value.dtype.kind in "biuf" and value.size:
                yield prefix + name, value
        elif isinstance(value, dict):
            yield from _flat(value, store, f"{prefix}{name}.", depth + 1)
        elif isinstance(value, Reference) and store is not None:
            for class_name, properties in store.objects_of(value.content):
                yield from _object(class_name, properties, store, prefix + name, depth)


def _by_label(structs: list[Fields]) -> Fields:
    """An array of structs as one struct: each under its own label (signals of Simulink's scopes, of dSPACE ControlDesk), or
    its number; a unit beside the values becomes part of their name.
    """
    named: Fields = {}
    for place, struct in enumerate(structs, start=1):
        texts = {name: value.strip() for name, value in struct.items() if isinstance(value, str)}
        label = next((texts[key] for key in LABELS if texts.get(key)), "") or str(place)
        unit = next((texts[key] for key in UNITS if texts.get(key)), "")
        label = label if label not in named else f"{label}:{place}"
        ended = f" [{unit}]" if unit_of(unit) is not None else ""
        numbers = {name: value for name, value in struct.items() if not isinstance(value, str)}
        named[label] = {
            f"{name}{ended}" if isinstance(value, np.ndarray) and value.size > 1 else name: value
            for name, value in numbers.items()
        }
    return named


def _by_name(elements: list[Any], store: ObjectStore | None) -> Fields:
    """Elements of a cell array, by their number; objects that have a Name (signals of a Simulink Dataset) by that."""
    named: Fields = {}
    for place, element in enumerate(elements, start=1):
        label = ""
        if store is not None and (isinstance(element, Reference) or is_reference(element)):
            content = element.content if isinstance(element, Reference) else element
            names = [properties.get("Name") for _, properties in store.objects_of(content)]
            label = next((each.strip() for each in names if isinstance(each, str)), "")
        label = label or str(place)
        named[label if label not in named else f"{label}:{place}"] = element
    return named


def _object(
    class_name: str, properties: Fields, store: ObjectStore, name: str, depth: int
) -> Iterator[tuple[str, NDArray[Any]]]:
    seconds = _seconds(class_name, properties)
    if seconds is not None:
        yield name, seconds
        return
    fields = as_fields(class_name, properties)
    if fields is None:
        yield from _flat(properties, store, f"{name}.", depth + 1)
        return
    rows = fields.get("Time")
    if isinstance(rows, dict) and "sampleRate" in rows:
        count = max((len(each) for each in fields.values() if isinstance(each, np.ndarray)), default=0)
        rate = float(np.ravel(rows["sampleRate"])[0])
        step = dict(_flat({"step": rows.get("stepSize")}, store, depth=depth + 1)).get("step")
        period = (
            1 / rate
            if np.isfinite(rate) and rate > 0
            else float(np.ravel(step)[0])
            if step is not None
            else 1.0
        )
        fields = fields | {"Time": np.arange(count) * period}
    yield from _flat(fields, store, f"{name}.", depth + 1)


def _seconds(class_name: str, properties: Fields) -> NDArray[np.float64] | None:
    """Durations in s, dates in ms since 1970 (told as an epoch later); None for other classes."""
    if class_name == "duration" and isinstance(properties.get("millis"), np.ndarray):
        return np.asarray(properties["millis"], dtype=np.float64) * 1e-3
    if class_name == "datetime" and isinstance(properties.get("data"), np.ndarray):
        return np.real(properties["data"]).astype(np.float64)
    return None


def table_of_variables(path: Path, variables: Mapping[str, NDArray[Any]]) -> ForeignTable:
    """Arrays by name as columns: a column of a two-dimensional one is NAME:K, K from 1; single numbers are scalars.

    Raises InputError: none of them is a column.
    """
    columns: list[ForeignColumn] = []
    scalars: dict[str, float] = {}
    for name, values in variables.items():
        squeezed: NDArray[Any] = np.squeeze(values)
        if squeezed.size == 1:
            scalars[name] = float(squeezed.reshape(()))
        elif squeezed.ndim == 1:
            columns.append(_column(name, squeezed))
        elif squeezed.ndim == 2:
            rows, across = squeezed.shape
            tall = squeezed if rows >= across else squeezed.T
            columns += [_column(f"{name}:{k + 1}", tall[:, k]) for k in range(min(rows, across))]
    if not columns:
        raise InputError(f"{path}: holds no column of numbers")
    return ForeignTable(path, tuple(columns), scalars)


def _column(name: str, values: NDArray[Any]) -> ForeignColumn:
    unit = split_name(name)[1]
    whole = values.dtype.kind in "iu" and values.dtype.itemsize == 8
    numbers = values.astype(np.int64) if whole else values.astype(np.float64)
    return ForeignColumn(name, numbers, None, unit, "the name" if unit else "")
