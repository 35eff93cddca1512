"""The two sessions of a proof on the drive, and what is stored of them: recordings, document and picture, with the experiment."""

from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from api.compensation import TorqueAhead, compared, following_limits
from api.compensation_picture import draw
from daq.excitation.excitation_plan import ExcitationPlan
from daq.following_error import FollowingError, following_error
from daq.plan_setpoints import plan_counts
from daq.rig import Rig
from daq.session_workflow import PayloadSession
from daq.torque_offset import SentAhead
from identify.recording.atomic_file import write_atomically
from identify.recording.experiment_file import Payload
from identify.results.compensation import CompensationDocument

FOLDER = "compensation"
"""inside the experiment's folder; a folder for each proof, which is an experiment of its own with two validation sessions"""
DOCUMENT = "compensation.json"
PICTURE = "following-error.svg"


class CompensationRun:
    """One proof: `without()`, then `with_torque()`, each a session to be taken through its steps; then `document()`."""

    def __init__(
        self,
        rig: Rig,
        experiment: Path,
        plan: ExcitationPlan,
        payload: Payload,
        operator: str,
        ahead: TorqueAhead,
        seed: int | None = None,
    ) -> None:
        self._rig, self._plan, self._payload, self._operator = rig, plan, payload, operator
        self._ahead, self._seed = ahead, seed
        self.folder = _next_folder(experiment / FOLDER)
        self._counts = plan_counts(rig, plan)
        self._first: PayloadSession | None = None
        self._second: PayloadSession | None = None

    def without(self) -> PayloadSession:
        """The session without torque sent ahead."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self._first = self._session(None)
        return self._first

    def with_torque(self) -> PayloadSession:
        """The session with it, its following error bounded by that of the first, which must have come to its end."""
        self._second = self._session(SentAhead(self._ahead.offset.counts, self.limits()))
        return self._second

    def limits(self) -> NDArray[np.float64]:
        """(n,) rad or m: following errors at which the second drive of the plan is stopped."""
        return following_limits(self._rig, self._error(self._first))

    def words(self) -> str:
        """What is about to be sent, for the operator."""
        listed = zip(self._rig.axes, self._ahead.offset.largest, self.limits(), strict=True)
        return "; ".join(
            f"{axis.joint} up to {largest:.3g} A ahead, stopped at a following error of {limit:.3g}"
            for axis, largest, limit in listed
        )

    def document(
        self, experiment: str, model: str, part: Literal["whole", "friction"], share: float
    ) -> CompensationDocument:
        """What came of it, stored with the recordings."""
        first, second = self._first, self._second
        assert first is not None
        assert second is not None
        assert first.file is not None
        before, after = self._error(first), self._error(second)
        result = CompensationDocument(
            experiment=experiment,
            rig=self._rig.name,
            payload=self._payload.name,
            model=model,
            part=part,
            share=share,
            recording_without=first.file.name,
            recording_with=None if second.file is None else second.file.name,
            completed=second.state.value == "done",
            reason=second.reason,
            following_limits=tuple(float(limit) for limit in self.limits()),
            joints=compared(self._rig, self._ahead, before, after),
            folder=str(self.folder),
            remarks=self._ahead.remarks,
        )
        write_atomically(self.folder / DOCUMENT, (result.json_text(indent=1) + "\n").encode())
        write_atomically(self.folder / PICTURE, draw(self._rig, before, after))
        return result

    def _session(self, ahead: SentAhead | None) -> PayloadSession:
        return PayloadSession(
            self._rig,
            self.folder,
            self._plan,
            self._payload,
            self._operator,
            role="validation",
            seed=self._seed,
            ahead=ahead,
        )

    def _error(self, session: PayloadSession | None) -> FollowingError:
        n = len(self._rig.axes)
        if session is None or session.file is None or not session.file.exists():
            return FollowingError(np.zeros(0, np.int64), np.zeros((0, n)))
        return following_error(session.file, self._counts)


def _next_folder(folder: Path) -> Path:
    taken = [int(path.name) for path in folder.glob("[0-9]*") if path.name.isdigit()]
    return folder / f"{max(taken, default=-1) + 1:02d}"
