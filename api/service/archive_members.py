"""Which members of an uploaded archive are the experiment, however the program that packed it wrote their names.

A zip archive's names are bytes. Flag bit 11 says that they are UTF-8; without it the standard says code page 437, Finder writes
UTF-8 all the same (and letters with their accents apart), Explorer the code page of the machine, and Info-ZIP adds the true
name in an extra field (0x7075). So a name without the flag has several readings, and the right one is that which
`experiment.yaml` names. Backslashes, capitals and the way in which accents are composed make no difference.

(APPNOTE.TXT 6.3.10, sections 4.4.4, 4.6.9 and appendix D)
"""

import re
import unicodedata
import zipfile
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

from api.service.problems import Problem
from identify.recording.errors import InputError
from identify.recording.experiment_file import EXPERIMENT_FILE
from identify.recording.plain_text import printable

UTF8_NAME = 0x800
"""Flag bit 11 of a member."""
UNICODE_PATH = 0x7075
"""Extra field with the name in UTF-8."""
CODE_PAGES = ("cp437", "cp850", "cp1252")
"""What machines in the west write where the flag is not set; the first is the standard's."""
EXPERIMENT_NAMES = (EXPERIMENT_FILE, "experiment.yml")
MOST_MEMBERS = 5000
LONGEST_LIST = 20
"""Members that were passed over and are named; of more only the count is said."""
LEFTOVERS = re.compile(r"(^|/)(__macosx|\.[^/]*)(/|$)|(^|/)(thumbs\.db|desktop\.ini)$")
"""What Finder and Explorer put into folders for themselves, and hidden files; in small letters."""
GERMAN = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue"})


def key_of(name: str) -> str:
    """By which two ways to write one name are the same: composed accents, `/`, small letters."""
    return unicodedata.normalize("NFC", name).replace("\\", "/").removeprefix("./").casefold()


def leads_out(name: str) -> bool:
    """Whether a path is absolute or climbs above where it starts."""
    path = PurePosixPath(key_of(name))
    return path.is_absolute() or ".." in path.parts


def readings(member: zipfile.ZipInfo) -> list[str]:
    """What a member's name may be, the likeliest first."""
    matching = list(_unicode_paths(member.extra))
    if member.flag_bits & UTF8_NAME:
        return [*matching, member.filename]
    raw = member.filename.encode("cp437")  # as zipfile decoded it
    for encoding in ("utf-8", *CODE_PAGES):
        try:
            matching.append(raw.decode(encoding))
        except UnicodeDecodeError:
            continue
    return list(dict.fromkeys(matching))


def _unicode_paths(extra: bytes) -> Iterator[str]:
    """The name in the extra field 0x7075: one byte of version, four of a checksum, then UTF-8."""
    while len(extra) >= 4:
        kind, length = int.from_bytes(extra[:2], "little"), int.from_bytes(extra[2:4], "little")
        content, extra = extra[4 : 4 + length], extra[4 + length :]
        if kind == UNICODE_PATH and len(content) > 5 and content[0] == 1:
            try:
                yield content[5:].decode()
            except UnicodeDecodeError:
                continue


def plain_name(name: str, ending: str) -> str:
    """A file name for any machine and any address: letters, digits, `_`, `.`, `-`; `ending` in small letters.

    name : the last part of a path, with the ending
    """
    stem = unicodedata.normalize("NFC", name)[: -len(ending)].translate(GERMAN)
    ascii_only = unicodedata.normalize("NFKD", stem).encode("ascii", "ignore").decode()
    plain = re.sub(r"[^A-Za-z0-9_.-]+", "-", ascii_only).strip("-.") or "session"
    return (plain if plain[0].isalnum() else f"session{plain}")[:90] + ending


@dataclass(frozen=True)
class Member:
    """A file in an archive, with what its name may be."""

    info: zipfile.ZipInfo
    names: tuple[str, ...]

    @property
    def shown(self) -> str:
        """The name for a person."""
        return printable(self.names[0])[:200]


class ArchiveMembers:
    """The files of an archive, looked up by the names that `experiment.yaml` uses.

    Raises the problem 413 if there are too many, InputError if a name leads out of the archive, or it does not hold
    exactly one experiment.
    """

    def __init__(self, archive: zipfile.ZipFile) -> None:
        if len(archive.infolist()) > MOST_MEMBERS:
            raise Problem(
                413, f"The archive holds {len(archive.infolist())} files; {MOST_MEMBERS} are the most."
            )
        members = [Member(info, tuple(readings(info))) for info in archive.infolist() if not info.is_dir()]
        for member in members:
            for name in member.names:
                if leads_out(name):
                    raise InputError(f"file: {member.shown!r} leads out of the archive; pack the folder anew")
        self._files = [each for each in members if not LEFTOVERS.search(key_of(each.names[0]))]
        self._leftovers = len(members) - len(self._files)
        self.experiment = self._only_experiment()
        folder = key_of(self.experiment.names[0]).rpartition("/")[0]
        self._beside: dict[str, list[Member]] = defaultdict(list)
        self._anywhere: dict[str, list[Member]] = defaultdict(list)
        for member in self._files:
            keys = {key_of(name) for name in member.names}
            for key in keys:
                if not folder or key.startswith(f"{folder}/"):
                    self._beside[key[len(folder) :].lstrip("/")].append(member)
            for last in {key.rpartition("/")[2] for key in keys}:
                self._anywhere[last].append(member)
        self._taken = {id(self.experiment)}

    def _only_experiment(self) -> Member:
        matching = [
            each for each in self._files if key_of(each.names[0]).rpartition("/")[2] in EXPERIMENT_NAMES
        ]
        if not matching:
            raise InputError(f"file: the archive holds no {EXPERIMENT_FILE}")
        depth = min(each.names[0].count("/") for each in matching)
        top = [each for each in matching if each.names[0].count("/") == depth]
        if len(top) > 1:
            names = ", ".join(each.shown for each in top[:LONGEST_LIST])
            raise InputError(
                f"file: the archive holds {len(top)} experiments ({names}); upload each by itself"
            )
        return top[0]

    def find(self, name: str) -> Member | None:
        """The member that `experiment.yaml` calls `name`; None where there is none.

        A file that lies in another folder than it is said to be in is taken by the last part of its name, if no other is
        called so.

        Raises InputError where several may be meant.
        """
        wanted = key_of(name)
        matching = self._beside.get(wanted) or self._anywhere.get(wanted.rpartition("/")[2], [])
        if len(matching) > 1:
            names = ", ".join(each.shown for each in matching[:LONGEST_LIST])
            raise InputError(
                f"file: {printable(name)!r} is in the archive {len(matching)} times ({names}); keep one"
            )
        return self._take(matching)

    def beside(self, name: str) -> Member | None:
        """The one member of that name in the folder of `experiment.yaml`, if there is one."""
        return self._take(self._beside.get(key_of(name), []))

    def _take(self, matching: list[Member]) -> Member | None:
        if not matching:
            return None
        self._taken.add(id(matching[0]))
        return matching[0]

    def passed_over(self) -> list[str]:
        """What was not taken, for a person: files by their names, the leftovers of the packing program together."""
        rest = [each.shown for each in self._files if id(each) not in self._taken]
        said = rest[:LONGEST_LIST]
        if len(rest) > LONGEST_LIST:
            said.append(f"{len(rest) - LONGEST_LIST} more files")
        if self._leftovers:
            said.append(f"{self._leftovers} hidden file{'s' if self._leftovers > 1 else ''}")
        return said


def known_ending(name: str, endings: Sequence[str]) -> str | None:
    """The ending of a name among those known, whatever its capitals; the longest that fits."""
    low = name.casefold()
    return next((each for each in sorted(endings, key=len, reverse=True) if low.endswith(each)), None)
