"""Sessions of an experiment out of logs of CAN frames, by a rig file's mapping."""

from collections.abc import Sequence
from pathlib import Path

from daq.can_log import LoggedSession, read_can_log, write_recording
from daq.experiment_folder import experiment_robot
from daq.rig import Rig
from identify.recording import (
    DeclaredSession,
    Experiment,
    ExperimentFile,
    InputError,
    Payload,
    append_session,
    load_experiment,
)
from identify.recording.experiment_file import (
    EXPERIMENT_FILE,
    check_settings,
    read_experiment_file,
    write_experiment,
)
from identify.recording.foreign_import import undone_on_error


def import_can_logs(
    files: Sequence[Path],
    source: str,
    folder: Path,
    *,
    append: bool,
    name: str | None,
    payload: str,
    role: str,
    begin: float | None,
    end: float | None,
) -> tuple[Experiment, list[LoggedSession]]:
    """Make an experiment of logs, or add them to the one in a folder: one session each, with a payload of the rig.

    source : rig file, or name of a rig

    Every session is read back. Nothing is left behind, and nothing changed, if something is wrong.

    Raises InputError: names the file, the option, or what the log lacks.
    """
    rig = Rig.load(source)
    carried = rig.payload(payload)
    there = folder / EXPERIMENT_FILE
    if there.exists() and not append:
        raise InputError(f"{there}: already exists; use --append to add a session to it")
    known = read_experiment_file(there) if append else None
    if known is not None and known.robot != experiment_robot(rig):
        raise InputError(f"{there}: its robot is not that of the rig {rig.name}; import into another folder")
    sessions = [read_can_log(file, rig, begin, end) for file in files]
    first = len(known.sessions) if known else 0
    names = [f"session-{first + index:02d}.h5" for index in range(len(files))]
    for each in names:
        if (folder / each).exists():
            raise InputError(f"{folder / each}: already exists; move it away")
    body = Payload(**carried.model_dump())
    with undone_on_error(folder, names):
        for file, each, session in zip(files, names, sessions, strict=True):
            write_recording(folder / each, session, rig, carried, role, file)
        if known is None:
            made = ExperimentFile(
                format=1,
                name=name or folder.resolve().name,
                robot=experiment_robot(rig),
                payloads=tuple(Payload(**each.model_dump()) for each in rig.payloads),
            )
            write_experiment(folder, made)
        for each in names:
            declared = {"file": each, "payload": carried.name, "role": role}
            append_session(folder, check_settings(DeclaredSession, declared, {}, "options: session"), body)
        experiment = load_experiment(folder)
        for entry in experiment.sessions[-len(names) :]:
            experiment.read(entry)
    return experiment, sessions
