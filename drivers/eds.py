"""EDS and DCF files read for what has to do with driving; what else is wrong in them is passed over and said.

CiA 306 says how such a file is written; files that come with drives say it otherwise: encodings, byte order marks, comments
that do not add up, doubled sections, empty numbers, words for numbers.
"""

from __future__ import annotations

import codecs
import re
from dataclasses import dataclass, field
from pathlib import Path

from canopen.objectdictionary import ObjectDictionary, ODArray, ODRecord, ODVariable, datatypes

Section = dict[str, str]

_OBJECT = re.compile(r"^(?:0x)?([0-9a-f]{3,4})h?$", re.IGNORECASE)
_SUBOBJECT = re.compile(
    r"^(?:0x)?([0-9a-f]{3,4})h?[\s_]*(?:sub|\.)[\s_]*(?:0x)?([0-9a-f]{1,2})$", re.IGNORECASE
)
_TYPES: dict[str, int] = {
    "BOOLEAN": datatypes.BOOLEAN,
    **{f"INTEGER{bits}": getattr(datatypes, f"INTEGER{bits}") for bits in (8, 16, 24, 32, 40, 48, 56, 64)},
    **{f"UNSIGNED{bits}": getattr(datatypes, f"UNSIGNED{bits}") for bits in (8, 16, 24, 32, 40, 48, 56, 64)},
    **{f"INT{bits}": getattr(datatypes, f"INTEGER{bits}") for bits in (8, 16, 32, 64)},
    **{f"UINT{bits}": getattr(datatypes, f"UNSIGNED{bits}") for bits in (8, 16, 32, 64)},
    "BOOL": datatypes.BOOLEAN,
    "SINT": datatypes.INTEGER8,
    "INT": datatypes.INTEGER16,
    "DINT": datatypes.INTEGER32,
    "USINT": datatypes.UNSIGNED8,
    "UINT": datatypes.UNSIGNED16,
    "UDINT": datatypes.UNSIGNED32,
    "REAL": datatypes.REAL32,
    "REAL32": datatypes.REAL32,
    "FLOAT": datatypes.REAL32,
    "REAL64": datatypes.REAL64,
    "VISIBLESTRING": datatypes.VISIBLE_STRING,
    "OCTETSTRING": datatypes.OCTET_STRING,
    "UNICODESTRING": datatypes.UNICODE_STRING,
    "DOMAIN": datatypes.DOMAIN,
}
"""Names of data types (CiA 301, table 44), and what some files call them, IEC 61131-3's among them; without blanks and lines."""
_KINDS = {"VAR": 7, "ARRAY": 8, "ARR": 8, "RECORD": 9, "REC": 9, "DOMAIN": 2, "DEFTYPE": 5, "DEFSTRUCT": 6}
_VAR, _ARRAY, _RECORD = 7, 8, 9
_LAST_STANDARD_TYPE = 0x1B
_ACCESS = frozenset(("rw", "ro", "wo", "const", "rwr", "rww"))
_MAPPING = {"TRUE": 1, "FALSE": 0, "YES": 1, "NO": 0, "TPDO": 1, "RPDO": 1, "OPTIONAL": 1, "DEFAULT": 1}
"""Words for PDOMapping, those of XDD files (CiA 311) among them."""
_REMARK = re.compile(r"\s+(?://|#).*$|;.*$")
"""a comment behind a value"""
_DEVICE_NUMBERS = {
    "VendorNumber": "vendor_number",
    "ProductNumber": "product_number",
    "RevisionNumber": "revision_number",
    "NrOfRXPDO": "nr_of_RXPDO",
    "NrOfTXPDO": "nr_of_TXPDO",
}
_DEVICE_WORDS = {"VendorName": "vendor_name", "ProductName": "product_name", "OrderCode": "order_code"}


class EdsVariable(ODVariable):
    """A variable of a file, which may say nothing of its mapping."""

    mapping_said = False
    """whether the file says if it may be mapped into a PDO"""


@dataclass
class ReadDictionary:
    """An object dictionary as far as its file could be read."""

    dictionary: ObjectDictionary
    passed_over: list[str] = field(default_factory=list[str])
    """What was passed over, each kind once, in words."""

    def say(self, remark: str) -> None:
        """Note what was passed over, once."""
        if remark not in self.passed_over:
            self.passed_over.append(remark)


def read_eds(path: Path, node: int) -> ReadDictionary:
    """Read an EDS or DCF file, with $NODEID replaced by `node`.

    Raises OSError: the file cannot be read.
    """
    read = ReadDictionary(ObjectDictionary())
    sections = _sections(_text(path.read_bytes(), read), read)
    _device(sections, read)
    compact: list[tuple[int, Section]] = []
    subobjects: list[tuple[int, int, Section]] = []
    odd: list[str] = []
    for name, section in sections.items():
        single, below = _OBJECT.match(name), _SUBOBJECT.match(name)
        if single:
            index = int(single[1], 16)
            kind = _number(section.get("objecttype", "7"), _KINDS)
            if kind is None:
                odd.append(name)
                kind = _VAR
            if kind in (_ARRAY, _RECORD):
                holder = ODArray if kind == _ARRAY else ODRecord
                read.dictionary.add_object(holder(_name(section, name), index))
                if _number(section.get("compactsubobj", "0")):
                    compact.append((index, section))
            elif index >= 0x1000:
                variable = _variable(section, index, 0, node, sections, odd)
                if variable is not None:
                    read.dictionary.add_object(variable)
        elif below:
            subobjects.append((int(below[1], 16), int(below[2], 16), section))
    for index, section in compact:
        _add_compact(read.dictionary, index, section, node, sections, odd)
    for index, subindex, section in subobjects:
        _add_subobject(read.dictionary, index, subindex, section, node, sections, odd)
    if odd:
        shown = ", ".join(dict.fromkeys(odd[:4])) + (" ..." if len(odd) > 4 else "")
        read.say(f"fields without a readable value in {len(set(odd))} of its objects ({shown})")
    return read


def _text(content: bytes, read: ReadDictionary) -> str:
    for mark, encoding in (
        (codecs.BOM_UTF8, "utf-8"),
        (codecs.BOM_UTF16_LE, "utf-16"),
        (codecs.BOM_UTF16_BE, "utf-16"),
    ):
        if content.startswith(mark):
            read.say("a byte order mark")
            return content.decode("utf-8-sig" if encoding == "utf-8" else encoding, errors="replace")
    beginning = content[:200]
    if beginning.count(0) > len(beginning) // 3:
        read.say("UTF-16 without a byte order mark")
        return content.decode("utf-16-le" if beginning.find(0) % 2 else "utf-16-be", errors="replace")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        read.say("signs that are not UTF-8 (read as Windows-1252)")
        return content.decode("cp1252", errors="replace")


def _sections(text: str, read: ReadDictionary) -> dict[str, Section]:
    """Sections by name, keys in small letters; of what is doubled the first stands."""
    sections: dict[str, Section] = {}
    current: Section | None = None
    for line in re.split(r"\r\n|\r|\n", text):
        bare = line.strip().lstrip("\ufeff")
        if not bare or bare.startswith((";", "#")):
            continue
        if bare.startswith("["):
            name = bare[1:].partition("]")[0].strip()
            known = next((key for key in (name, name.lower(), name.upper()) if key in sections), name)
            if known in sections:
                read.say("sections that occur twice (the first value of each field holds)")
            current = sections.setdefault(known, {})
            continue
        key, sign, value = bare.partition("=" if "=" in bare else ":")
        if not sign or current is None:
            read.say("lines that are neither a section nor a field")
            continue
        current.setdefault(key.strip().lower(), _REMARK.sub("", value).strip())
    comments = next((section for name, section in sections.items() if name.lower() == "comments"), Section())
    stated = _number(comments.get("lines", "0"))
    if stated != sum(key.startswith("line") and key != "lines" for key in comments):
        read.say("comments whose number does not add up")
    return sections


def _device(sections: dict[str, Section], read: ReadDictionary) -> None:
    device = next((section for name, section in sections.items() if name.lower() == "deviceinfo"), None)
    if device is None:
        read.say("no section DeviceInfo")
        return
    information = read.dictionary.device_information
    for key, attribute in _DEVICE_NUMBERS.items():
        if key.lower() in device:
            value = _number(device[key.lower()])
            if value is None:
                read.say(f"{key} '{device[key.lower()]}', which is no number")
            else:
                setattr(information, attribute, value)
    for key, attribute in _DEVICE_WORDS.items():
        setattr(information, attribute, device.get(key.lower(), ""))


def _name(section: Section, default: str) -> str:
    return section.get("parametername") or default


def _variable(
    section: Section, index: int, subindex: int, node: int, sections: dict[str, Section], odd: list[str]
) -> EdsVariable | None:
    """A variable; None where its type is not known, so that nothing can be said about it."""
    label = f"{index:04X}" + (f"sub{subindex:X}" if subindex else "")
    variable = EdsVariable(_name(section, label), index, subindex)
    kind = _number(re.sub(r"[\s_]", "", section.get("datatype", "")), _TYPES)
    if kind is not None and kind > _LAST_STANDARD_TYPE:
        defined = next(
            (entry for name, entry in sections.items() if name.lower() == f"{kind:x}sub1"), Section()
        )
        kind = _number(defined.get("defaultvalue", ""), _TYPES) or datatypes.DOMAIN
    if kind is None:
        odd.append(label)
        return None
    variable.data_type = kind
    access = section.get("accesstype", "rw").strip('"').lower()
    if access not in _ACCESS:
        odd.append(label)
        access = "rw"
    variable.access_type = access
    mappable = _number(section.get("pdomapping", ""), _MAPPING)
    variable.pdo_mappable, variable.mapping_said = bool(mappable), mappable is not None
    for key, attribute in (
        ("lowlimit", "min"),
        ("highlimit", "max"),
        ("defaultvalue", "default"),
        ("parametervalue", "value"),
    ):
        if section.get(key):
            setattr(variable, attribute, _value(section[key], kind, node))
    return variable


def _value(text: str, kind: int, node: int) -> int | float | str | bytes | None:
    """A value of an object; None where it cannot be read, which no drive cares for."""
    if kind in (datatypes.VISIBLE_STRING, datatypes.UNICODE_STRING):
        return text
    if kind in (datatypes.OCTET_STRING, datatypes.DOMAIN):
        try:
            return bytes.fromhex(text)
        except ValueError:
            return None
    if kind in (datatypes.REAL32, datatypes.REAL64):
        try:
            return float(text)
        except ValueError:
            return None
    plain = text.upper().replace(" ", "")
    offset = node if "$NODEID" in plain else 0
    value = _number(re.sub(r"\+?\$NODEID\+?", "", plain) or "0")
    if value is None:
        return None
    bits = {
        datatypes.INTEGER8: 8,
        datatypes.INTEGER16: 16,
        datatypes.INTEGER32: 32,
        datatypes.INTEGER64: 64,
    }.get(kind)
    value += offset
    return value - (1 << bits) if bits and value >= 1 << (bits - 1) else value


def _add_subobject(
    dictionary: ObjectDictionary,
    index: int,
    subindex: int,
    section: Section,
    node: int,
    sections: dict[str, Section],
    odd: list[str],
) -> None:
    if index not in dictionary:
        dictionary.add_object(ODRecord(f"{index:04X}", index))
    holder = dictionary[index]
    variable = _variable(section, index, subindex, node, sections, odd)
    if variable is not None and isinstance(holder, (ODRecord, ODArray)):
        holder.add_member(variable)


def _add_compact(
    dictionary: ObjectDictionary,
    index: int,
    section: Section,
    node: int,
    sections: dict[str, Section],
    odd: list[str],
) -> None:
    """An array written as one section with its number of entries (CiA 306, CompactSubObj)."""
    count = ODVariable("Number of entries", index, 0)
    count.data_type = datatypes.UNSIGNED8
    first = _variable(section, index, 1, node, sections, odd)
    holder = dictionary[index]
    if first is not None and isinstance(holder, (ODRecord, ODArray)):
        holder.add_member(count)
        holder.add_member(first)


def _number(text: str, by_name: dict[str, int] | None = None) -> int | None:
    """A whole number in any spelling: 0x1F, 31, 001, 1Fh; or a word that stands for one; None if it is neither."""
    bare = text.strip().strip('"').upper()
    if by_name and bare in by_name:
        return by_name[bare]
    bare = bare.rstrip("UL")
    try:
        if bare.startswith("0X"):
            return int(bare, 16)
        return int(bare[:-1], 16) if bare.endswith("H") else int(bare, 10)
    except ValueError:
        return None
