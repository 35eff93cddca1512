"""The catalogue of an experiment's sessions: what is known of each, and whether and as what models use it.

Whether a session takes part, and in which role, stands in the experiment's own file, for the identifier to read wherever
it runs. Notes stand beside it (session_notes.py).
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple

from api.service.database import SessionRow
from api.service.experiment_store import ExperimentStore
from api.service.folder_description import INCOMPLETE
from api.service.jobs import Job
from api.service.model_workflow import ModelWorkflow
from api.service.problems import Problem
from api.service.proof_drives import drive_of_proof
from api.service.session_facts import FileFacts, SessionFacts
from api.service.session_notes import read_notes, write_notes
from daq.experiment_folder import changing
from identify.recording import InputError, change_session
from identify.recording.experiment_file import DeclaredSession

Role = Literal["identification", "validation"]


class Use(NamedTuple):
    """Whether and as what models use a session; `excluded` is the reason, None where it takes part."""

    role: str
    excluded: str | None

    @property
    def fitted(self) -> bool:
        """Whether models are fitted to it."""
        return self.role == "identification" and self.excluded is None


@dataclass(frozen=True)
class CatalogueEntry:
    """One session. `excluded` is the reason, None where it takes part; `note` is empty where nobody wrote one."""

    row: SessionRow
    facts: SessionFacts
    excluded: str | None
    note: str

    @property
    def rig(self) -> str | None:
        """The rig that it was measured on; None for one that was measured elsewhere."""
        return self.row.rig or self.facts.rig

    @property
    def plan(self) -> str | None:
        """The plan that was driven."""
        return self.row.plan or self.facts.plan

    @property
    def measured(self) -> bool:
        """Whether the experiment's file lists it: whole, or admitted although it ended early."""
        recorded = self.row.file is not None and not self.row.file.startswith(INCOMPLETE)
        return recorded and drive_of_proof(self.row) is None


class SessionCatalogue:
    """Sessions of all experiments."""

    def __init__(self, experiments: ExperimentStore, models: ModelWorkflow, facts: FileFacts) -> None:
        self._experiments = experiments
        self._models = models
        self._facts = facts

    def entries(self, experiment: str) -> list[CatalogueEntry]:
        """All sessions, by their ids. Raises the problem 404."""
        return self._described(experiment, self._experiments.sessions(experiment))

    def entry(self, experiment: str, session: str) -> CatalogueEntry:
        """One session. Raises the problem 404."""
        return self._described(experiment, [self._experiments.session(experiment, session)])[0]

    def rigs(self, experiment: str) -> list[str]:
        """The rigs that the sessions of an experiment were measured on, each once, the newest last."""
        entries = sorted(self.entries(experiment), key=lambda entry: entry.row.created)
        rigs = [entry.rig for entry in entries if entry.rig is not None]
        return list(dict.fromkeys(reversed(rigs)))[::-1]

    def other_rig(self, experiment: str, rig: str) -> str | None:
        """The warning, in words that name both, where an experiment's sessions were measured on another rig than `rig`."""
        sessions = [entry for entry in self.entries(experiment) if entry.measured]
        rigs = list(dict.fromkeys(entry.rig for entry in sessions if entry.rig != rig))
        if not rigs:
            return None
        names = " and ".join(each or "a rig that is not named" for each in rigs)
        return (
            f"The sessions of {self._experiments.row(experiment).name} were measured on {names}; the rig chosen is {rig}. "
            "One model of two machines describes neither: choose a new experiment, unless it is the same machine."
        )

    def change(
        self,
        experiment: str,
        session: str,
        user: str,
        *,
        role: Role | None = None,
        excluded: str | Literal[False] | None = None,
        note: str | None = None,
    ) -> Job | None:
        """Change a session's role, exclude it from all models or include it again, and write a note; all of it or nothing.
        Models are fitted again where the data have changed: returns that job.

        role     : fit models to it, or only check them on it; None to leave it
        excluded : the reason, which is kept in the experiment's file; False to include it again, None to leave it
        note     : kept beside it; an empty one removes it, None leaves it

        Raises the problem 404, 409 (it was not measured, or no session would be left to fit), 422 (no reason).
        """
        entry = self.entry(experiment, session)
        before = Use(entry.row.role, entry.excluded)
        after = before
        if role is not None:
            self._require_listed(entry)
            after = after._replace(role=role)
        if excluded is False:
            after = after._replace(excluded=None)
        elif excluded is not None:
            reason = " ".join(excluded.split())
            if not reason:
                raise Problem(422, "Give the reason why the session is excluded: it is kept with the data.")
            self._require_listed(entry)
            after = after._replace(excluded=reason)
        if before.fitted and not after.fitted:
            self._require_another(
                experiment, entry, "exclude" if after.excluded is not None else "check only on"
            )
        if note is not None and entry.row.file is None:
            raise Problem(
                409, f"The session {session} is {entry.row.state}: write the note once it is measured."
            )
        changes = {name: value for name, value in after._asdict().items() if value != getattr(before, name)}
        job = self._change(experiment, entry, user, **changes) if changes else None
        if note is not None and note.strip() != entry.note:
            self._write_note(experiment, entry.row, note)
        return job

    # --- inside

    def _write_note(self, experiment: str, row: SessionRow, note: str) -> None:
        folder, file = self._experiments.folder(experiment), row.file or ""
        with changing(folder):
            notes = read_notes(folder) | {file.rpartition("/")[2]: note.strip()}
            kept = {of: note_text for of, note_text in notes.items() if note_text}
            write_notes(folder, kept)

    def _described(self, experiment: str, rows: list[SessionRow]) -> list[CatalogueEntry]:
        folder = self._experiments.folder(experiment)
        declared, notes = self._declared(experiment), read_notes(folder)
        facts = self._facts.of([folder / (row.file or "not measured") for row in rows])
        return [
            CatalogueEntry(
                row=row,
                facts=known,
                excluded=declared[row.file].excluded if row.file in declared else None,
                note=notes.get((row.file or "").rpartition("/")[2], ""),
            )
            for row, known in zip(rows, facts, strict=True)
        ]

    def _declared(self, experiment: str) -> dict[str, DeclaredSession]:
        """File -> what the experiment's file says of it; nothing where somebody broke that file, which is said elsewhere."""
        try:
            return {each.file: each for each in self._experiments.declared(experiment).sessions}
        except InputError:
            return {}

    @staticmethod
    def _require_listed(entry: CatalogueEntry) -> None:
        if not entry.measured:
            raise Problem(
                409,
                f"The session {entry.row.id} is {entry.row.state}: no model uses it. Measure it, recover it or admit it first.",
            )

    def _require_another(self, experiment: str, entry: CatalogueEntry, verb: str) -> None:
        """Refuse to take the last session from the fit."""
        left = [
            other
            for other in self.entries(experiment)
            if other.measured
            and other.row.id != entry.row.id
            and other.excluded is None
            and other.row.role == "identification"
        ]
        if not left:
            raise Problem(
                409,
                f"{entry.row.id} is the only session that models are fitted to. Measure or include another, then {verb} it.",
            )

    def _change(self, experiment: str, entry: CatalogueEntry, user: str, **changes: str | None) -> Job:
        folder = self._experiments.folder(experiment)
        with changing(folder):
            change_session(folder, entry.row.file or "", **changes)
        self._experiments.refresh(experiment)
        return self._models.refit(experiment, user)
