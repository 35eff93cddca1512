"""The files of the rigs: those of this lab, and those that come with the software."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from api.service.problems import not_found
from daq.experiment_folder import experiment_robot
from daq.files_as_read import FilesAsRead, rig_as_read
from daq.rig import RIGS, Rig
from identify.recording import ExperimentFile, InputError
from identify.recording.plain_text import check_printable


class RigStore:
    """All rigs of this service.

    folder : rigs of this lab, beside those that come with the software; a file here replaces one of the
    same name
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def files(self) -> dict[str, Path]:
        """Id -> file of every rig."""
        files = {path.stem: path for path in sorted(RIGS.glob("*.yaml"))}
        if self._folder.is_dir():
            files |= {path.stem: path for path in sorted(self._folder.glob("*.yaml"))}
        return files

    def file(self, identifier: str) -> Path:
        """The file of a rig. Raises the problem 404."""
        file = self.files().get(identifier)
        if file is None:
            raise not_found("rig", identifier)
        return file

    def rig(self, identifier: str) -> Rig:
        """The checked settings of a rig. Raises the problem 404, and InputError if its file is wrong."""
        with self._shown_file(identifier) as file:
            return Rig.load(file)

    def rig_as_read(self, identifier: str) -> tuple[Rig, FilesAsRead]:
        """The same with the files that it is made from, as they are now. Raises as `rig`."""
        with self._shown_file(identifier) as file:
            return rig_as_read(file)

    @contextmanager
    def _shown_file(self, identifier: str) -> Generator[Path]:
        """The file of a rig, named without its folder in what is wrong with it."""
        file = self.file(identifier)
        try:
            yield file
        except InputError as error:
            raise InputError(str(error).replace(f"{file.parent}/", "")) from error

    def experiment_file(self, rig_id: str, name: str) -> ExperimentFile:
        """An experiment without sessions on a rig. Raises InputError for an unknown or wrong rig."""
        if rig_id not in self.files():
            raise InputError(f"rig: {rig_id!r} is not known; known are {', '.join(self.files())}")
        try:
            check_printable(name)
        except ValueError as error:
            raise InputError(f"name: {error}") from error
        rig = self.rig(rig_id)
        return ExperimentFile(
            format=1,
            name=name,
            robot=experiment_robot(rig),
            payloads=rig.payloads,
        )
