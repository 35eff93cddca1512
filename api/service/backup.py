"""A copy of a data folder in one file, and the folder made of it again.

A service may run meanwhile: SQLite is copied by its own online backup, an experiment is not changed while its files are
copied, and a recording that is under way is in the copy as far as it was flushed (`coulomb recover` closes it after a restore).
"""

import gzip
import hashlib
import io
import os
import shutil
import sqlite3
import tarfile
import tempfile
import time
from contextlib import closing, nullcontext
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO

from pydantic import BaseModel, ConfigDict, ValidationError

from daq.experiment_folder import changing
from daq.recording_file import software_version
from identify.recording.errors import InputError
from identify.recording.first_fault import first_fault

FORMAT = 1
MANIFEST = "manifest.json"
"""Last in the archive: what is in it, with sizes and digests."""
DATABASE = "service.sqlite"
FOLDERS = ("experiments", "rigs", "plans")
BLOCK = 1 << 20
FAST = 1
"""Level of gzip: samples hardly shrink further, and take ten times as long to."""


class ArchivedFile(BaseModel):
    """One file of an archive; of one written out again, the time of its change is not looked at."""

    model_config = ConfigDict(frozen=True)

    bytes: int
    sha256: str
    changed_ns: int | None = None
    """ns since 1970"""


class Manifest(BaseModel):
    """What is in an archive."""

    model_config = ConfigDict(frozen=True)

    format: int
    software_version: str
    created: float
    """s since 1970"""
    files: dict[str, ArchivedFile]
    """by name within the data folder"""


@dataclass(frozen=True)
class BackupReport:
    """What was copied: files, their bytes, and whether the database is among them."""

    files: int
    bytes: int
    database: bool


def write_backup(data_folder: Path, target: Path, *, with_database: bool = True) -> BackupReport:
    """Copy experiments, rigs, plans and the SQLite database into a tar archive; packed by gzip where its name ends in .gz.

    The key of the cookies is left out: after a restore everybody signs in again.

    with_database : False where it is not SQLite, and has tools of its own

    Raises InputError where the folder is none of ours, or the target cannot be written; no half archive is left.
    """
    if not (data_folder / "experiments").is_dir():
        raise InputError(f"{data_folder}: not a data folder; it has no folder `experiments`")
    part = target.with_name(f"{target.name}.part")
    try:
        descriptor = os.open(part, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o600)  # it holds password hashes
        with os.fdopen(descriptor, "w+b") as stream:
            report = _write(data_folder, stream, target.name.lower().endswith(".gz"), with_database)
            stream.flush()
            os.fsync(stream.fileno())
        part.replace(target)
    except OSError as error:
        raise InputError(f"{target}: cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)
    return report


def restore_backup(archive: Path, data_folder: Path) -> BackupReport:
    """Make a data folder of a backup; all digests are checked before it stands under its name.

    Raises InputError where the folder has something in it, or the archive is none of ours, damaged or incomplete.
    """
    if data_folder.exists() and any(data_folder.iterdir()):
        raise InputError(f"{data_folder}: is not empty; restore into a folder that does not exist yet")
    data_folder.parent.mkdir(parents=True, exist_ok=True)
    place = Path(tempfile.mkdtemp(prefix=f".{data_folder.name}-restored-", dir=data_folder.parent))
    try:
        report = _extract(archive, place)
        place.chmod(0o755)
        if data_folder.exists():
            data_folder.rmdir()
        place.rename(data_folder)
    except (tarfile.TarError, EOFError, OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{archive}: not a backup that can be read ({error})") from error
    finally:
        shutil.rmtree(place, ignore_errors=True)
    return report


def _write(data_folder: Path, stream: IO[bytes], packed: bool, with_database: bool) -> BackupReport:
    entries: dict[str, ArchivedFile] = {}
    packing = gzip.GzipFile(fileobj=stream, mode="wb", compresslevel=FAST) if packed else nullcontext(stream)
    with packing as written, tarfile.open(fileobj=written, mode="w") as tar:
        if with_database and (data_folder / DATABASE).is_file():
            with tempfile.TemporaryDirectory(dir=data_folder) as place:
                copy = Path(place) / DATABASE
                _copy_sqlite(data_folder / DATABASE, copy)
                _add(tar, copy, DATABASE, entries)
        for folder in FOLDERS:
            for top in sorted((data_folder / folder).glob("*")):
                if top.name.startswith("."):
                    continue  # uploads on their way
                if top.is_dir() and folder == "experiments":
                    with changing(top):
                        _add_tree(tar, top, data_folder, entries)
                else:
                    _add_tree(tar, top, data_folder, entries)
        manifest = Manifest(
            format=FORMAT, software_version=software_version(), created=time.time(), files=entries
        )
        text = manifest.model_dump_json(indent=1).encode()
        info = tarfile.TarInfo(MANIFEST)
        info.size, info.mtime = len(text), int(time.time())
        tar.addfile(info, io.BytesIO(text))
    return BackupReport(len(entries), sum(each.bytes for each in entries.values()), DATABASE in entries)


def _copy_sqlite(source: Path, target: Path) -> None:
    with (
        closing(sqlite3.connect(f"file:{source}?mode=ro", uri=True)) as running,
        closing(sqlite3.connect(target)) as copy,
    ):
        running.backup(copy)


def _add_tree(tar: tarfile.TarFile, top: Path, root: Path, entries: dict[str, ArchivedFile]) -> None:
    for path in sorted(top.rglob("*")) if top.is_dir() else [top]:
        if path.is_file() and not path.is_symlink():
            _add(tar, path, path.relative_to(root).as_posix(), entries)


def _add(tar: tarfile.TarFile, path: Path, name: str, entries: dict[str, ArchivedFile]) -> None:
    """Add a file as long as it is now; what a recorder appends meanwhile is left for the next backup."""
    with path.open("rb") as stream:
        info = tar.gettarinfo(arcname=name, fileobj=stream)
        info.uid = info.gid = 0
        info.uname = info.gname = ""
        digested = _Digested(stream)
        tar.addfile(info, digested)  # type: ignore[arg-type] - of a file it wants `read` alone
        changed = os.fstat(stream.fileno()).st_mtime_ns
    entries[name] = ArchivedFile(bytes=info.size, sha256=digested.digest.hexdigest(), changed_ns=changed)


class _Digested:
    """A stream whose digest is taken while it is read."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self.digest = hashlib.sha256()

    def read(self, count: int = -1) -> bytes:
        block = self._stream.read(count)
        self.digest.update(block)
        return block


def _extract(archive: Path, place: Path) -> BackupReport:
    members: dict[str, ArchivedFile] = {}
    manifest = None
    with tarfile.open(archive, "r:*") as tar:
        for member in tar:
            if manifest is not None or not member.isfile() or not _ours(member.name):
                raise InputError(f"{archive}: {member.name!r} is not part of a backup")
            stream = tar.extractfile(member)
            assert stream is not None
            if member.name == MANIFEST:
                manifest = _manifest(stream.read(1 << 28), archive)
                continue
            members[member.name] = _write_out(stream, place / member.name)
    if manifest is None:
        raise InputError(f"{archive}: incomplete; its list of files is missing at the end")
    if manifest.format != FORMAT:
        raise InputError(f"{archive}: its format is {manifest.format}; known here is {FORMAT}")
    for name in sorted(manifest.files.keys() | members.keys()):
        copied, written = manifest.files.get(name), members.get(name)
        if (
            copied is None
            or written is None
            or (copied.bytes, copied.sha256) != (written.bytes, written.sha256)
        ):
            raise InputError(f"{archive}: damaged: {name} is not as it was when it was copied")
        if copied.changed_ns is not None:
            # Fits know the data that they were made of by size and time of change.
            os.utime(place / name, ns=(copied.changed_ns, copied.changed_ns))
    (place / "experiments").mkdir(exist_ok=True)
    return BackupReport(len(members), sum(each.bytes for each in members.values()), DATABASE in members)


def _manifest(content: bytes, archive: Path) -> Manifest:
    try:
        return Manifest.model_validate_json(content)
    except ValidationError as error:
        raise InputError(f"{archive}: its list of files, {MANIFEST}: {first_fault(error)}") from None


def _ours(name: str) -> bool:
    parts = PurePosixPath(name).parts
    return name in (MANIFEST, DATABASE) or (len(parts) > 1 and parts[0] in FOLDERS and ".." not in parts)


def _write_out(stream: IO[bytes], path: Path) -> ArchivedFile:
    path.parent.mkdir(parents=True, exist_ok=True)
    digested = _Digested(stream)
    descriptor = os.open(
        path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600 if path.name == DATABASE else 0o644
    )
    with os.fdopen(descriptor, "wb") as target:
        shutil.copyfileobj(digested, target, BLOCK)  # type: ignore[misc] - it wants `read` alone
    return ArchivedFile(bytes=path.stat().st_size, sha256=digested.digest.hexdigest())
