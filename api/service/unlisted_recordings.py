"""Recordings that no model uses yet: closed where their process died, listed where a person has looked at them."""

from typing import TYPE_CHECKING

from api.service.accounts import User
from api.service.database import SessionRow
from api.service.experiment_store import ExperimentStore
from api.service.folder_description import INCOMPLETE
from api.service.model_workflow import ModelWorkflow
from api.service.payload_sessions import PayloadSessions
from api.service.problems import Problem
from api.service.proof_drives import drive_of_proof
from api.service.session_ids import session_id
from daq.session_events import SessionState

if TYPE_CHECKING:
    from daq.recovery import RecordingState

RECORDING = "recording"
"""State of a recording that grows, or whose process died."""
ENDED_EARLY = frozenset({SessionState.ABORTED.value, SessionState.FAULTED.value})
"""States of a recording that somebody or something ended before its plan did."""


class UnlistedRecordings:
    """Decides about recordings whose session ended before its plan did."""

    def __init__(
        self, experiments: ExperimentStore, models: ModelWorkflow, sessions: PayloadSessions
    ) -> None:
        self._experiments = experiments
        self._models = models
        self._sessions = sessions

    def recover(self, experiment: str, identifier: str, user: User) -> SessionRow:
        """Close a recording whose process died; every row that was flushed is kept, and it is listed if it may serve.

        Raises the problem 409 if the recording is closed or still grows.
        """
        row = self._of_no_proof(experiment, identifier)
        if self._sessions.has_under_way(row):
            raise Problem(409, "The session is under way; stop it first, or wait for its end.")
        if row.file is None or row.state != RECORDING:
            raise Problem(409, f"The session {identifier} is {row.state}: there is nothing to recover.")
        from daq.recovery import admit_if_it_may_serve, being_written, recover_recording

        folder = self._experiments.folder(experiment)
        if being_written(folder / row.file):
            raise Problem(409, f"The session {identifier} is still being recorded; stop it first.")
        reason = f"the recording process died; recovered by {user.name}"
        state = admit_if_it_may_serve(folder, recover_recording(folder / row.file, "aborted", reason))
        return self._listed_or_kept(experiment, identifier, user, state)

    def admit(self, experiment: str, identifier: str, user: User) -> SessionRow:
        """List a session that a limit, a fault or somebody ended: a person has looked at it, and it is to be used.

        Raises the problem 409 if it is listed already, or lacks too much to serve.
        """
        row = self._of_no_proof(experiment, identifier)
        kept = row.file is not None and row.file.startswith(INCOMPLETE)
        if row.file is None or not kept or row.state not in ENDED_EARLY:
            raise Problem(409, f"The session {identifier} is {row.state}: nothing is to be decided about it.")
        from daq.recovery import admit_if_it_may_serve, recording_state

        folder = self._experiments.folder(experiment)
        state = admit_if_it_may_serve(folder, recording_state(folder / row.file), decided=True)
        if not state.admitted:
            raise Problem(409, f"The session {identifier} cannot be used: {state.lacks}.")
        return self._listed_or_kept(experiment, identifier, user, state)

    def _of_no_proof(self, experiment: str, identifier: str) -> SessionRow:
        row = self._experiments.session(experiment, identifier)
        if drive_of_proof(row) is not None:
            raise Problem(
                409, f"{identifier} is a drive of a proof, which no model uses: prepare it again there."
            )
        return row

    def _listed_or_kept(
        self, experiment: str, identifier: str, user: User, state: "RecordingState"
    ) -> SessionRow:
        """What became of a recording that was looked at anew; once it is listed, all sessions are identified anew."""
        self._experiments.refresh(experiment)
        if not state.admitted:
            return self._experiments.session(experiment, identifier)
        self._models.refit(experiment, user.name)
        return self._experiments.session(experiment, session_id(state.path.name))
