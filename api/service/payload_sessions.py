"""Payload sessions on the rigs: the steps that people take, and what becomes of their recordings.

The motion itself is the business of `daq.session_workflow`, whose processes neither need this service nor
wait for it.
"""

import logging
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, TypeVar

from api.service.accounts import User
from api.service.active_session import MOVING, ActiveSession, open_payload_session
from api.service.audit import AuditLog
from api.service.bus_claims import BusClaims
from api.service.database import LONGEST_WORDS, SessionRow
from api.service.experiment_store import ExperimentStore
from api.service.model_workflow import ModelWorkflow
from api.service.plan_store import PlanStore
from api.service.problems import Problem
from api.service.proof_drives import drive_of_proof
from api.service.proofs import Proofs
from api.service.rig_operators import RigOperators
from api.service.rig_store import RigStore
from api.service.session_payload import described
from daq.excitation.plan_limits import require_within_limits
from daq.files_as_read import FilesAsRead
from daq.session_events import SessionEvent, SessionState, StepOutOfTurn
from identify.recording.errors import InputError
from identify.recording.experiment_file import ExperimentFile, Payload

if TYPE_CHECKING:
    from daq.excitation.excitation_plan import ExcitationPlan
    from daq.rig_check import RigCheck
    from daq.torque_offset import SentAhead

_log = logging.getLogger(__name__)


Listener = Callable[[ActiveSession], None]
Result = TypeVar("Result")


class PayloadSessions:
    """Creates sessions, takes their steps, and follows them to their end."""

    def __init__(
        self,
        experiments: ExperimentStore,
        rigs: RigStore,
        operators: RigOperators,
        claims: BusClaims,
        plans: PlanStore,
        models: ModelWorkflow,
        proofs: Proofs,
        audit: AuditLog,
        clock: Callable[[], float],
        could_stop_now: Callable[[], bool] = lambda: True,
    ) -> None:
        self._experiments = experiments
        self._rigs = rigs
        self._operators = operators
        self._claims = claims
        self._plans = plans
        self._models = models
        self._proofs = proofs
        self._audit = audit
        self._clock = clock
        self._could_stop_now = could_stop_now
        self._active: dict[str, ActiveSession] = {}
        self._lock = Lock()
        self._listeners: set[Listener] = set()

    # --- looking

    def active(self, rig: str) -> ActiveSession | None:
        """The session that has this rig's bus, also one that has just ended."""
        return self._active.get(rig)

    def under_way(self) -> ActiveSession | None:
        """A session that is armed or running, on whichever rig."""
        return next((active for active in list(self._active.values()) if active.moves), None)

    def has_under_way(self, row: SessionRow) -> bool:
        """Whether this session has its rig's bus and has not ended."""
        return self._is_active(row) and not self._active[row.rig or ""].state.ended

    def listen(self, listener: Listener) -> None:
        """Call `listener(active)` after every event of a session, from that session's thread; it must return at once."""
        self._listeners.add(listener)

    def unlisten(self, listener: Listener) -> None:
        """Call it no more."""
        self._listeners.discard(listener)

    # --- before the motion

    def create(
        self,
        experiment: str,
        user: User,
        *,
        rig: str,
        plan: str,
        payload: Payload,
        role: str,
    ) -> SessionRow:
        """Prepare a session; nothing is touched yet.

        Raises the problem 404 (experiment, rig, plan), 409 (somebody else has the rig), and InputError if
        the plan or the payload does not fit.
        """
        self.require_preparable(self._experiments.declared(experiment), rig=rig, plan=plan, payload=payload)
        self._refuse_second(experiment)
        self._operators.take(rig, user)
        self._forget_unrecorded(experiment)
        row = SessionRow(
            experiment=experiment,
            id=self._experiments.next_session_id(experiment),
            file=None,
            payload=payload,
            weighed=None,
            role=role,
            rig=rig,
            plan=plan,
            state=SessionState.NEW.value,
            reason=None,
            created=self._clock(),
        )
        self._experiments.change_session(row)
        return row

    def require_preparable(self, declared: ExperimentFile, *, rig: str, plan: str, payload: Payload) -> None:
        """Whether a session can be prepared in an experiment, which need not be stored yet.

        Raises the problem 404 (rig, plan), and InputError if the plan or the payload does not fit.
        """
        settings = self._rigs.rig(rig)
        joints = [joint.name for joint in declared.robot.joints]
        if [axis.joint for axis in settings.axes] != joints:
            raise InputError(f"rig: {rig} does not have the experiment's joints ({', '.join(joints)})")
        require_within_limits(self._plans.plan(plan), settings)
        for known in declared.payloads:
            if known.name == payload.name and known.model_dump() != payload.model_dump():
                raise InputError(
                    f"payload: the experiment has another payload {payload.name} ({known.mass} kg); "
                    "use another name, or that payload"
                )
        of_rig = next((each for each in settings.payloads if each.name == payload.name), payload)
        declared_names = {each.name for each in declared.payloads}
        if payload.name not in declared_names and of_rig.model_dump() != payload.model_dump():
            raise InputError(
                f"payload: the rig file of {rig} has another payload {payload.name} ({of_rig.mass} kg, not {payload.mass} kg); "
                "use another name, or prepare the session with that payload"
            )

    def discard(self, experiment: str, identifier: str, user: User) -> None:
        """Forget a session that was not measured. Raises the problem 409 for any other."""
        row = self._prepared(experiment, identifier)
        active = self._active[row.rig or ""] if self._is_active(row) else None
        if active is not None and (active.state in MOVING or row.file is not None):
            raise Problem(409, "The session is armed, running or recorded; it is kept.")
        self._operators.take(row.rig or "", user)
        if active is not None:
            active.close()
            del self._active[active.rig]
        self._experiments.forget_session(row)

    def check(self, experiment: str, identifier: str, user: User) -> "RigCheck":
        """Take the bus and check nodes, homing and limits; returns the RigCheck.

        Raises the problem 409 if another session has the bus.
        """
        row = self._prepared(experiment, identifier)
        rig = row.rig or ""
        settings, made_from = self._rigs.rig_as_read(rig)
        made_from |= FilesAsRead.of(self._files_of_motion(row))
        folder, plan, ahead = self._driven(row)
        self._operators.take(rig, user)
        with self._lock:
            self._end_session_at_rest(rig)
            payload_session = open_payload_session(
                settings,
                folder,
                plan,
                described(row.payload),
                user.name,
                on_event=lambda event: self._event(active, event),
                role=row.role,
                after_session=lambda _recorded: self._recorded(active),
                sign_of_life=self._could_stop_now,
                ahead=ahead,
                admissible=drive_of_proof(row) is None,
                made_from=made_from,
            )
            active = ActiveSession(
                rig,
                experiment,
                self._experiments.row(experiment).name,
                identifier,
                payload_session,
                user.name,
            )
            active.claim = self._claims.claim(rig, settings.bus, active)
            self._active[rig] = active
        return self._take(active, payload_session.check)

    def _files_of_motion(self, row: SessionRow) -> list[Path]:
        """The files that say what is driven."""
        if drive_of_proof(row) is not None:
            return self._proofs.files_of_motion(row)
        return [self._plans.file(row.plan or "")]

    def _driven(self, row: SessionRow) -> "tuple[Path, ExcitationPlan, SentAhead | None]":
        """Where a session is recorded, what is driven, and what is sent beside the setpoints.

        Raises InputError where that, or the payload, is not what the session was prepared with.
        """
        if drive_of_proof(row) is not None:
            return self._proofs.driven(row)
        declared = self._experiments.declared(row.experiment)
        payload = described(row.payload)
        self.require_preparable(declared, rig=row.rig or "", plan=row.plan or "", payload=payload)
        return self._experiments.folder(row.experiment), self._plans.plan(row.plan or ""), None

    def weigh(self, experiment: str, identifier: str, user: User, mass: Callable[[], float]) -> SessionRow:
        """Note the payload's mass in kg as `mass()` says, typed or from the scale.

        Raises the problem 409 once the payload is confirmed.
        """
        row = self._prepared(experiment, identifier)
        if row.state in (SessionState.CONFIRMED, SessionState.ARMED, SessionState.RUNNING) or row.file:
            raise Problem(
                409,
                f"The session is {row.state}, its payload weighed; for another, prepare a new session.",
            )
        self._operators.take(row.rig or "", user)
        row.weighed = mass()
        self._experiments.change_session(row)
        return row

    def confirm(self, experiment: str, identifier: str, user: User) -> SessionRow:
        """The operator confirms that this payload is mounted; the weighed mass must be the payload's.

        A confirmation belongs to who starts: who has taken the rig over since confirms anew, when it is armed too.
        """
        active = self._step(experiment, identifier)
        weighed = self._experiments.session(experiment, identifier).weighed
        if weighed is None:
            raise Problem(409, "Weigh the payload first.")
        self._operators.take(active.rig, user)
        if active.state not in (SessionState.CONFIRMED, SessionState.ARMED) or self.is_confirmed(active):
            self._take(active, lambda: active.payload_session.confirm_payload(weighed))
        active.confirmed_in = self._operators.tenure(active.rig)
        return self._row(active)

    def is_confirmed(self, active: ActiveSession) -> bool:
        """Whether who operates the rig now has confirmed the payload."""
        return active.confirmed_in == self._operators.tenure(active.rig)

    def _confirmed_step(self, experiment: str, identifier: str, user: User) -> ActiveSession:
        active = self._step(experiment, identifier)
        self._operators.take(active.rig, user)  # a confirmation is of a turn of operating
        if active.state in (SessionState.CONFIRMED, SessionState.ARMED) and not self.is_confirmed(active):
            raise Problem(
                409,
                f"The payload was confirmed before {user.name} operated the rig; look at it, and confirm that it is mounted "
                "and that nobody is within reach.",
            )
        return active

    def arm(self, experiment: str, identifier: str, user: User, client: str = "") -> SessionRow:
        """Start recorder and monitors; the next step moves the robot."""
        active = self._confirmed_step(experiment, identifier, user)
        self._asked(active, user, "session arm", client)
        self._take(active, active.payload_session.arm)
        return self._row(active)

    def start(self, experiment: str, identifier: str, user: User, client: str = "") -> SessionRow:
        """Move the robot."""
        active = self._confirmed_step(experiment, identifier, user)
        # Written before anything moves: without a log there is no motion.
        self._asked(active, user, "session start", client)
        self._take(active, active.payload_session.start)
        return self._row(active)

    # --- stopping

    def rigs(self) -> list[str]:
        """Rigs that had a session since the service began."""
        return list(self._active)

    def alarms(self) -> dict[str, str]:
        """What a person must do now, by rig: an axis may have power or move. Until the rig's next session has checked it."""
        alarms = {rig: active.payload_session.alarm for rig, active in list(self._active.items())}
        return {rig: alarm for rig, alarm in alarms.items() if alarm}

    def rig_of(self, experiment: str, identifier: str) -> str | None:
        """The rig that has this session, or had it last; None where none did since the service began."""
        sessions = list(self._active.values())
        return next(
            (each.rig for each in sessions if (each.experiment, each.id) == (experiment, identifier)), None
        )

    def stop(self, rig: str, name: str) -> bool | None:
        """Bring the rig to rest, now, for the person of that name; harmless when repeated.

        Returns whether there was a session to stop, None if the rig had none since the service began.
        """
        active = self._active.get(rig)
        if active is None:
            return None
        if active.state.ended:
            return False
        stop = partial(active.payload_session.stop, f"stopped by {name}")
        if active.state is SessionState.NEW:
            # Nothing moves yet, and a session without processes ends in our own index: that may wait.
            threading.Thread(target=stop).start()
        else:
            stop()
        return True

    def stop_all(self, reason: str) -> None:
        """Bring every rig to rest."""
        for active in list(self._active.values()):
            active.payload_session.stop(reason)

    def close(self) -> None:
        """Stop everything and let the processes end; the recordings are kept."""
        for active in list(self._active.values()):
            active.close()

    def reason(self, active: ActiveSession) -> str:
        """Why a session ended, in words; empty while it has not."""
        return self._experiments.shown(active.payload_session.reason)

    # --- inside

    def _prepared(self, experiment: str, identifier: str) -> SessionRow:
        row = self._experiments.session(experiment, identifier)
        if row.rig is None or (row.file is not None and not self._is_active(row)):
            raise Problem(409, f"The session {identifier} is {row.state}; prepare a new one.")
        return row

    def _is_active(self, row: SessionRow) -> bool:
        active = self._active.get(row.rig or "")
        return active is not None and active.id == row.id and active.experiment == row.experiment

    def _refuse_second(self, experiment: str) -> None:
        """One session at a time is prepared, so that its id is the number under which it is recorded."""
        for row in self._experiments.sessions(experiment):
            if row.file is not None:
                continue
            if not SessionState(row.state).ended:
                raise Problem(409, f"The session {row.id} is being prepared; finish or discard it first.")

    def _forget_unrecorded(self, experiment: str) -> None:
        """Sessions that ended before anything was recorded give their number to the next."""
        for row in self._experiments.sessions(experiment):
            if row.file is None and SessionState(row.state).ended:
                self._experiments.forget_session(row)

    def _step(self, experiment: str, identifier: str) -> ActiveSession:
        row = self._prepared(experiment, identifier)
        if not self._is_active(row):
            raise Problem(409, "Check the rig first.")
        return self._active[row.rig or ""]

    def _end_session_at_rest(self, rig: str) -> None:
        """A session that moves nothing gives way to the next one on its rig."""
        other = self._active.get(rig)
        if other is None:
            return
        if other.moves:
            raise Problem(
                409, f"The session {other.id} of {other.experiment_name} is {other.state.value} on this rig."
            )
        other.close()

    def _take(self, active: ActiveSession, step: Callable[[], Result]) -> Result:
        try:
            return step()
        except StepOutOfTurn as error:
            raise Problem(409, str(error)) from error
        finally:
            self._store(active)

    def _row(self, active: ActiveSession) -> SessionRow:
        return self._experiments.session(active.experiment, active.id)

    def _asked(self, active: ActiveSession, user: User, action: str, client: str) -> None:
        target = f"rig {active.rig}, experiment {active.experiment}, {active.id}"
        self._audit.append(user, action, target, "asked", client=client)

    def _event(self, active: ActiveSession, event: SessionEvent) -> None:
        if event.kind != "progress":
            active.events.append(replace(event, words=self._experiments.shown(event.words)))
        if event.state.ended and active.claim is not None:
            active.claim.release()  # its processes have ended before it says so
        try:
            if event.kind == "state":
                self._follow(active, event)
        except Exception:
            # The motion goes on whatever our database says; the recording is the truth.
            _log.exception("session %s of %s: the index was not updated", active.id, active.experiment)
        self._announce(active)

    def _follow(self, active: ActiveSession, event: SessionEvent) -> None:
        self._store(active)
        if not event.state.ended:
            return
        row = self._row(active)
        if drive_of_proof(row) is not None:
            self._proofs.conclude(row)
        else:
            self._experiments.refresh(active.experiment)

    def _recorded(self, active: ActiveSession) -> None:
        """The recording stands in the experiment: identify over all sessions so far, unless it is the drive of a proof."""
        if drive_of_proof(self._row(active)) is not None:
            return
        self._experiments.refresh(active.experiment)
        self._models.refit(active.experiment, active.user)
        self._announce(active)

    def _announce(self, active: ActiveSession) -> None:
        for listener in list(self._listeners):
            listener(active)

    def _store(self, active: ActiveSession) -> None:
        """Bring the index up to where the session stands now, whichever thread comes last."""
        with active.storing:
            row = self._experiments.session(active.experiment, active.id)
            row.state = active.state.value
            row.reason = self.reason(active)[:LONGEST_WORDS] or None
            file = active.payload_session.file
            if file is not None and file.is_file():
                row.file = str(file.relative_to(self._experiments.folder(active.experiment)))
            else:  # a recording without a single row is not kept
                row.file = None
            self._experiments.change_session(row)
