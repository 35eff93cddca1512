"""The two sessions of a proof on the drive from the command line, one after the other in one process."""

from pathlib import Path
from typing import Self

from api.compensation_picture import draw
from api.proof import Proof, read_errors, remove_proof
from api.unfinished_run import close_unfinished
from daq.files_as_read import FilesAsRead
from daq.session_events import SessionState
from daq.session_workflow import PayloadSession
from daq.torque_offset import SentAhead
from identify.recording.atomic_file import write_atomically
from identify.results.compensation import CompensationDocument

PICTURE = "following-error.svg"


class CompensationRun:
    """One proof: `without()`, then `with_torque()`, each a session to be taken through its steps; then `document()`."""

    def __init__(self, proof: Proof, seed: int | None = None, made_from: FilesAsRead | None = None) -> None:
        """made_from : the files that the rig was read from, which both runs stand on"""
        self.proof, self._seed, self._made_from = proof, seed, made_from
        self._first: PayloadSession | None = None
        self._recorded_first: Path | None = None
        self._second: PayloadSession | None = None

    @classmethod
    def continued(cls, proof: Proof, seed: int | None = None, made_from: FilesAsRead | None = None) -> Self:
        """A proof whose first run was driven to its end at another time; what is missing is `with_torque()`.

        Raises InputError: the first run was not driven to its end, or both were.
        """
        run = cls(proof, seed, made_from)
        run._recorded_first = proof.first_run()
        close_unfinished(proof.folder)
        return run

    def without(self) -> PayloadSession:
        """The session without feedforward torque."""
        self.proof = self.proof.store()
        self._first = self._session(self.proof.first())
        return self._first

    def with_torque(self) -> PayloadSession:
        """The session with it, its following error bounded by that of the first, which must have come to its end."""
        self._second = self._session(self.proof.sent(self._recorded()))
        return self._second

    def forget_unless_driven(self) -> None:
        """Remove the proof's folder where nothing was recorded: the first session never came to motion."""
        first = self._first
        if first is None or (first.file is not None and first.file.exists()):
            return
        remove_proof(self.proof.folder)

    @property
    def is_half(self) -> bool:
        """Whether the first run is recorded and the second never came to motion: the pair is to be continued."""
        second = self._second
        return second is None or second.file is None or not second.file.exists()

    def words(self) -> str:
        """What is about to be sent, for the operator."""
        return "; ".join(self.proof.words(self._recorded()))

    def document(self) -> CompensationDocument:
        """What came of it, stored with the recordings, and the picture."""
        second = self._second
        assert second is not None
        completed = second.state is SessionState.DONE
        document = self.proof.conclude(self._recorded(), second.file, completed, second.reason)
        errors = read_errors(self.proof.folder)
        assert errors is not None
        write_atomically(self.proof.folder / PICTURE, draw(self.proof.rig, errors))
        return document

    def _recorded(self) -> Path:
        if self._recorded_first is not None:
            return self._recorded_first
        assert self._first is not None
        assert self._first.file is not None
        return self._first.file

    def _session(self, ahead: SentAhead | None) -> PayloadSession:
        proof = self.proof
        return PayloadSession(
            proof.rig,
            proof.folder,
            proof.plan,
            proof.settings.payload,
            proof.settings.operator,
            role="validation",
            seed=self._seed,
            ahead=ahead,
            admissible=False,
            made_from=self._made_from,
        )
