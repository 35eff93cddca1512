"""An experiment made of other people's measurements, whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from identify.recording.errors import InputError
from identify.recording.experiment import Experiment, load_experiment
from identify.recording.experiment_file import (
    EXPERIMENT_FILE,
    DeclaredSession,
    ExperimentFile,
    Payload,
    PriorBodies,
    Robot,
    append_session,
    check_settings,
    keep_prior,
    write_experiment,
)
from identify.recording.foreign.roles import ColumnMap, MeasuredSession
from identify.recording.strict_yaml import read_strict_yaml, strict_yaml_text

COLUMNS_FILE = "import.yaml"
"""Beside the experiment: which column was what, so that another session is added without naming them again."""


@dataclass(frozen=True)
class NewSession:
    """A session to be added to an experiment."""

    file: str
    """Name of its file in the experiment's folder."""
    measured: MeasuredSession
    payload: Payload
    role: str


def import_sessions(
    sessions: Sequence[NewSession],
    folder: Path,
    robot: Robot | None,
    name: str,
    columns: ColumnMap,
    prior: PriorBodies | None = None,
) -> Experiment:
    """Write sessions and the experiment that declares them; with `robot` None they are added to the experiment there.

    prior : the links by the robot's file, kept with the experiment

    Every session is read back. Nothing is left behind, and nothing changed, if something is wrong.

    Raises InputError: names the file and column, or the option.
    """
    if robot is not None and (folder / EXPERIMENT_FILE).exists():
        raise InputError(f"{folder / EXPERIMENT_FILE}: already exists; use --append to add a session to it")
    declared = []
    for session in sessions:
        body = {"file": session.file, "payload": session.payload.name, "role": session.role}
        declared.append(check_settings(DeclaredSession, body, {}, "options: session"))
        if not session.file.lower().endswith((".csv", ".csv.gz")) or Path(session.file).name != session.file:
            raise InputError(f"--session: '{session.file}' must be a plain name that ends in .csv or .csv.gz")
        if (folder / session.file).exists():
            raise InputError(f"{folder / session.file}: already exists; choose another name for the session")
    with undone_on_error(folder, [session.file for session in sessions]):
        for session in sessions:
            session.measured.write(folder / session.file)
        if robot is not None:
            payloads = tuple(dict.fromkeys(session.payload for session in sessions))
            document = {
                "format": 1,
                "name": name,
                "robot": robot.model_dump(),
                "payloads": [payload.model_dump() for payload in payloads],
                "sessions": [each.model_dump() for each in declared],
                "prior": prior and prior.model_dump(),
            }
            write_experiment(folder, check_settings(ExperimentFile, document, {}, "options"))
            _write_columns(folder / COLUMNS_FILE, columns)
        else:
            for session, each in zip(sessions, declared, strict=True):
                append_session(folder, each, session.payload)
            if prior is not None:
                keep_prior(folder, prior)
        experiment = load_experiment(folder)
        for entry in experiment.sessions[-len(sessions) :]:
            experiment.read(entry)
    return experiment


@contextmanager
def undone_on_error(folder: Path, files: Sequence[str]) -> Iterator[None]:
    """Make a folder; on an error take away what came into it, and put back the experiment that stood there."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    settings = [folder / EXPERIMENT_FILE, folder / COLUMNS_FILE]
    before = {path: path.read_bytes() if path.is_file() else None for path in settings}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException as error:
        for name in files:
            _remove(folder / name)
        for path, content in before.items():
            if content is None:
                _remove(path)
            elif path.read_bytes() != content:
                path.write_bytes(content)
        for path in missing:
            if path.is_dir() and not any(path.iterdir()):
                path.rmdir()
        if isinstance(error, FileExistsError):
            raise InputError(f"--out {folder}: is a file; give a folder") from None
        if isinstance(error, OSError):
            raise InputError(f"--out {folder}: cannot be written: {error.strerror or error}") from None
        raise


def _remove(path: Path) -> None:
    with suppress(FileNotFoundError, NotADirectoryError):
        path.unlink()


def _write_columns(path: Path, columns: ColumnMap) -> None:
    document = {
        each.name: list(value) if isinstance(value, tuple) else value
        for each in fields(columns)
        if (value := getattr(columns, each.name))
    }
    path.write_text(strict_yaml_text(document), encoding="utf-8")


def read_columns(folder: Path) -> ColumnMap | None:
    """The columns that the sessions of an experiment were imported from; None where that is not recorded.

    Raises InputError: the record is not valid.
    """
    path = folder / COLUMNS_FILE
    if not path.is_file():
        return None
    document, lines = read_strict_yaml(path)
    known = {each.name: each for each in fields(ColumnMap)}
    if not isinstance(document, dict) or not set(document) <= set(known):
        raise InputError(
            f"{path}: holds other fields than {', '.join(known)}; remove the file to name columns anew"
        )
    values: dict[str, Any] = {}  # keyword arguments of several types, checked one by one below
    for name, value in document.items():
        if isinstance(value, list) and all(isinstance(item, (str, int, float)) for item in value):
            values[name] = tuple(value)
        elif isinstance(value, (str, int, float)) and name in ("time", "rate", "time_unit", "joined_unit"):
            values[name] = value
        else:
            raise InputError(f"{path} line {lines[(name,)]}: {name}: must be a list of names")
    try:
        return ColumnMap(**values)
    except TypeError:
        raise InputError(f"{path}: position and command are missing") from None
