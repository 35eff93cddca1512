"""Experiments and their recordings: listed, made, imported, downloaded."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from api.client.connection import Connection, Signals, opened, view_of
from api.service.experiment_documents import ExperimentSummary, ExperimentView, Imported, ImportedRecords
from api.service.job_documents import JobView
from api.service.record_documents import CanLogImport, Dialect, RecordDescription, RecordImport
from api.service.session_documents import RecordingSummary


class ExperimentCalls(Connection):
    """What a client can ask about experiments."""

    def experiments(self) -> list[ExperimentSummary]:
        """All experiments, the one changed last first."""
        return self._all(ExperimentSummary, "/experiments")

    def experiment(self, experiment: str) -> ExperimentView:
        """One experiment with its payloads and sessions."""
        return self._one(ExperimentView, f"/experiments/{experiment}")

    def create_experiment(self, name: str, rig: str) -> ExperimentView:
        """An experiment without sessions on a rig."""
        return self._done(ExperimentView, "/experiments", {"name": name, "rig": rig})

    def start_demo(self) -> JobView:
        """Measure three payload sessions on the simulated arm and fit the first model.

        Returns the job, whose result names the new experiment and its model.
        """
        return self._begin("/experiments/demo")

    def import_experiment(self, archive: Path | str) -> Imported:
        """Store an experiment measured elsewhere: a .zip of experiment.yaml and its sessions.

        Returns the experiment and the job of its first identification.
        """
        with Path(archive).open("rb") as stream:
            answer = self._http.post("/experiments/import", files={"file": stream})
        return self._sent(Imported, answer)

    def import_session(
        self,
        experiment: str,
        file: Path | str,
        payload: str,
        role: Literal["identification", "validation"] = "identification",
        mass: float | None = None,
    ) -> Imported:
        """Add a session measured elsewhere (.csv, .csv.gz, .h5); `mass` in kg adds a payload of that name."""
        fields = {"payload": payload, "role": role} | ({"mass": str(mass)} if mass is not None else {})
        with Path(file).open("rb") as stream:
            files = {"file": (Path(file).name, stream)}
            answer = self._http.post(f"/experiments/{experiment}/sessions/import", data=fields, files=files)
        return self._sent(Imported, answer)

    def describe_records(
        self, files: Sequence[Path | str], dialect: Dialect | None = None
    ) -> list[RecordDescription]:
        """What other people's records hold, and what their columns probably are; nothing is kept there."""
        fields = dialect.model_dump(exclude_none=True) if dialect else {}
        with opened(files) as parts:
            answer = self._http.post("/experiments/import/columns", data=fields, files=parts)
        return [view_of(RecordDescription, each, str(answer.url)) for each in self._answer(answer)]

    def import_records(
        self, files: Sequence[Path | str], settings: RecordImport, robot: Path | str | None = None
    ) -> ImportedRecords:
        """Make an experiment of other people's records; `robot` is a URDF, SDF or MJCF.

        Returns the experiment, what was decided on the way, and the job of its first identification.
        """
        fields = {"settings": settings.model_dump_json()}
        with opened(files) as parts, opened([robot] if robot else [], "robot") as described:
            sent = [*parts, *described]
            answer = self._http.post("/experiments/import/records", data=fields, files=sent)
        return self._sent(ImportedRecords, answer)

    def import_can_logs(self, files: Sequence[Path | str], settings: CanLogImport) -> ImportedRecords:
        """Make an experiment of logs of a CAN bus by the mapping of a rig, or add them to one.

        Returns the same as `import_records`.
        """
        with opened(files) as parts:
            sent = self._http.post(
                "/experiments/import/can-logs", data={"settings": settings.model_dump_json()}, files=parts
            )
        return self._sent(ImportedRecords, sent)

    def recordings(self, experiment: str) -> list[RecordingSummary]:
        """The recordings of an experiment, also those that ended badly."""
        return self._all(RecordingSummary, f"/experiments/{experiment}/recordings")

    def download(
        self,
        experiment: str,
        session: str,
        target: Path | str,
        format: Literal["original", "hdf5", "csv", "raw", "mat", "parquet", "hdf5-si"] = "original",
    ) -> Path:
        """Write a recording to the file `target`, which must not exist yet; returns its path."""
        path = Path(target)
        address = f"/experiments/{experiment}/recordings/{session}"
        with self._http.stream("GET", address, params={"format": format}) as answer:
            self._checked(answer)
            with path.open("xb") as stream:
                for block in answer.iter_bytes():
                    stream.write(block)
        return path

    def recorded_signals(
        self,
        experiment: str,
        session: str,
        joint: int = 1,
        start: float | None = None,
        end: float | None = None,
        points: int = 2000,
    ) -> tuple[NDArray[np.float64], Signals]:
        """Time (M,) s and `position`, `command` (M,) of a joint counted from 1, between `start` and `end` s.

        More than `points` samples come as pairs of smallest and largest value.
        """
        address = f"/experiments/{experiment}/recordings/{session}/signals"
        return self._signals(address, {"joint": joint, "from": start, "to": end, "points": points})
