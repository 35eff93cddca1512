"""YAML read strictly: no key twice, numbers as YAML 1.2 writes them, and the line of every field kept.

PyYAML alone takes the last of two equal keys, reads `1e-3` as a text and `no` as false; each of them turns
a slip of the pen into a wrong number without a word.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, ClassVar

import yaml

from identify.recording.errors import InputError

Lines = dict[tuple[str | int, ...], int]

_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
# An experiment, a rig or a plan is a page of text; a larger file is a mistake (a session given instead, say).
LARGEST_FILE = 4_000_000
MOST_VALUES = 100_000
"""An alias stands for all it refers to, so that a few lines of YAML can mean billions of values."""
DEEPEST = 64
"""Lists and mappings within each other; none of our files has ten. libyaml's composer calls itself for each and ends the program
where its stack does."""
LONGEST_WHOLE_NUMBER = 18
"""Digits; more are no number that a setting could have."""


class _StrictLoader(_Loader):  # type: ignore[misc, valid-type]
    """The safe loader with the scalars of YAML 1.2 (core schema) instead of those of YAML 1.1."""

    yaml_implicit_resolvers: ClassVar[dict[str, list[tuple[str, re.Pattern[str]]]]] = {}


class _StrictDumper(yaml.SafeDumper):
    """Puts a text in quotes that either version of YAML would read as something else: PyYAML writes `08` and `1e3` bare, which
    are numbers in YAML 1.2."""


for _scalar_tag, _form, _first in (
    ("null", r"^(?:~|null|Null|NULL|)$", ["~", "n", "N", ""]),
    ("bool", r"^(?:true|True|TRUE|false|False|FALSE)$", list("tTfF")),
    ("int", r"^[-+]?[0-9]+$", list("-+0123456789")),
    (
        "float",
        r"^(?:[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$",
        list("-+.0123456789"),
    ),
):
    for _side in (_StrictLoader, _StrictDumper):
        _side.add_implicit_resolver(f"tag:yaml.org,2002:{_scalar_tag}", re.compile(_form), _first)

_NULL, _BOOL = "tag:yaml.org,2002:null", "tag:yaml.org,2002:bool"
_INT, _FLOAT, _STR = "tag:yaml.org,2002:int", "tag:yaml.org,2002:float", "tag:yaml.org,2002:str"


def read_strict_yaml(path: Path) -> tuple[Any, Lines]:
    """Read one YAML document from a file.

    Returns the document (dicts, lists, texts, numbers, booleans, None) and the line (from 1) of each of its
    fields, keyed by the path to the field.

    Raises InputError: the file cannot be read, is not UTF-8 or not YAML, or holds a key twice.
    """
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise InputError(
                f"{path}: larger than {LARGEST_FILE // 1_000_000} MB, so not a file of settings in YAML"
            )
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    return decode_strict_yaml(content, path)


def decode_strict_yaml(content: bytes, path: Path | str) -> tuple[Any, Lines]:
    """Decode one YAML document, as a file holds it; `path` names it in messages (see `read_strict_yaml`)."""
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise InputError(f"{path} line {line}: not UTF-8 text; save the file as UTF-8") from None
    return parse_strict_yaml(text, path)


def strict_yaml_text(document: object, width: int = 110, lists_in_line: bool = False) -> str:
    """A document as YAML that `parse_strict_yaml` reads as it was, and PyYAML too.

    lists_in_line : whether lists of plain values stand in one line
    """
    style = None if lists_in_line else False
    return yaml.dump(
        document,
        Dumper=_StrictDumper,
        sort_keys=False,
        allow_unicode=True,
        default_flow_style=style,
        width=width,
    )


def parse_strict_yaml(text: str, path: Path | str) -> tuple[Any, Lines]:
    """Parse one YAML document from a text; `path` names it in messages (see `read_strict_yaml`)."""
    lines: Lines = {}
    loader: Any = None
    try:
        _check_depth(text, path)
        loader = _StrictLoader(text)
        root = loader.get_single_node()
        return (None if root is None else _value(root, (), lines, path)), lines
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f" line {mark.line + 1}" if mark else ""
        what = " ".join(part for part in (error.context, error.problem) if part)
        if mark and "\t" in "".join(text.splitlines()[mark.line : mark.line + 1])[: mark.column + 1]:
            what = "a tab; indent with spaces"
        raise InputError(f"{path}{where}: not valid YAML: {what}") from None
    except yaml.YAMLError as error:
        raise InputError(f"{path}: not valid YAML: {' '.join(str(error).split())}") from None
    finally:
        if loader is not None:
            loader.dispose()


def _check_depth(text: str, path: Path | str) -> None:
    """Raises InputError: lists and mappings lie deeper within each other than in any file of settings."""
    depth = 0
    for event in yaml.parse(text, Loader=_Loader):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > DEEPEST:
                raise InputError(_too_deep(path, event.start_mark.line + 1))
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1


def _too_deep(path: Path | str, line: int) -> str:
    return f"{path} line {line}: more than {DEEPEST} lists and mappings within each other, so it is not a file of settings"


def _value(node: yaml.Node, place: tuple[str | int, ...], lines: Lines, path: Path | str) -> Any:
    line = node.start_mark.line + 1
    if len(place) > DEEPEST:  # an alias within what it stands for
        raise InputError(_too_deep(path, line))
    lines.setdefault(place, line)
    if len(lines) > MOST_VALUES:
        raise InputError(f"{path}: holds more than {MOST_VALUES} values, so it is not a file of settings")
    if isinstance(node, yaml.MappingNode):
        # what YAML holds is not known before its model has checked it
        mapping: dict[str, Any] = {}
        for key_node, value_node in node.value:
            key_line = key_node.start_mark.line + 1
            if not isinstance(key_node, yaml.ScalarNode):
                raise InputError(f"{path} line {key_line}: a key must be a plain word")
            key = key_node.value
            if key in mapping:
                raise InputError(
                    f"{path} line {key_line}: '{key}' occurs twice (first in line {lines[(*place, key)]});"
                    " keep one"
                )
            lines[(*place, key)] = key_line
            mapping[key] = _value(value_node, (*place, key), lines, path)
        return mapping
    if isinstance(node, yaml.SequenceNode):
        return [_value(item, (*place, index), lines, path) for index, item in enumerate(node.value)]
    return _scalar(node, line, path)


def _scalar(node: yaml.Node, line: int, path: Path | str) -> Any:
    text = node.value
    if node.tag == _NULL:
        return None
    if node.tag == _BOOL:
        return text.lower() == "true"
    if node.tag == _INT:
        if len(text) > LONGEST_WHOLE_NUMBER:
            raise InputError(f"{path} line {line}: {text[:20]}... is too large a number")
        return int(text)
    if node.tag == _FLOAT:
        return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
    if node.tag == _STR:
        return text
    raise InputError(f"{path} line {line}: the tag {node.tag} is not used here; write a plain value")
