"""Proofs on the drive: prepared by a job, driven as two sessions with the steps of every other, compared, and kept.

A model makes its machine better, or it does not: the same plan is driven without and with the model's feedforward torque.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from api.proof import (
    AHEAD,
    PLAN,
    FollowingErrors,
    Part,
    Proof,
    ProofSettings,
    TorqueAhead,
    first_recording,
    next_folder,
    prepared_rig,
    proof_folders,
    read_conclusion,
    read_errors,
    read_settings,
)
from api.proof_drive import Drive
from api.service.accounts import User
from api.service.active_session import ActiveSession
from api.service.bus_claims import BusClaims
from api.service.database import SessionRow
from api.service.experiment_store import ExperimentStore
from api.service.job_documents import JobResult
from api.service.jobs import Arguments, Job, JobRunner
from api.service.model_story import ModelStory
from api.service.plan_store import PlanStore
from api.service.problems import Problem, not_found
from api.service.proof_drives import drive_of_proof
from api.service.rig_operators import RigOperators
from api.service.rig_store import RigStore
from api.service.session_ids import drive_id
from api.unfinished_run import UnfinishedRun, close_unfinished, unfinished_run
from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.plan_limits import require_within_limits
from daq.excitation.standard_plan import standard_plan
from daq.files_as_read import drive_digests
from daq.rig import Rig
from daq.session_events import SessionState
from daq.torque_offset import SentAhead
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload
from identify.results.compensation import CompensationDocument

STANDARD_PLAN_SECONDS = 20.0

COMPUTATION = "api.service.use_computations:torque_along"


@dataclass(frozen=True)
class ProofState:
    """One proof, and how far it is.

    without, with_ : its drives as they were prepared last; None where they were not
    result         : what came of it; None until feedforward torque was sent
    elsewhere      : whether the run without feedforward torque was driven from the command line, where the second waits
    unfinished     : the run that ended last, where nobody wrote down what came of it, as after a kill
    """

    number: str
    settings: ProofSettings
    without: SessionRow | None
    with_: SessionRow | None
    result: CompensationDocument | None
    elsewhere: bool = False
    unfinished: UnfinishedRun | None = None

    @property
    def next(self) -> Drive | None:
        """The drive that is to be prepared or gone on with; None where both were driven to their end."""
        if self.result is not None and self.result.completed:
            return None
        return "with" if _done(self.without) else "without"

    def drive(self, drive: Drive) -> SessionRow | None:
        """One of the two."""
        return self.without if drive == "without" else self.with_


class Proofs:
    """The proofs of all experiments."""

    def __init__(
        self,
        experiments: ExperimentStore,
        rigs: RigStore,
        operators: RigOperators,
        claims: BusClaims,
        plans: PlanStore,
        jobs: JobRunner,
        clock: Callable[[], float],
    ) -> None:
        self._experiments = experiments
        self._rigs = rigs
        self._operators = operators
        self._claims = claims
        self._plans = plans
        self._jobs = jobs
        self._clock = clock
        self._lock = threading.Lock()

    def prepare(
        self,
        experiment: str,
        user: User,
        *,
        rig: str,
        plan: str,
        payload: str,
        model: str | None,
        part: Part,
        share: float,
    ) -> Job:
        """Compute what is sent along a plan (a job, whose result is {"proof": number}); nothing moves.

        model : a version's id, None for the current one

        Raises the problem 404 (experiment, rig, plan, model), 409 (no model yet), and InputError where rig, plan and payload do
        not go together. What may do harm is refused by the job, in its words.
        """
        settings, driven = self._rigs.rig(rig), self._plans.plan(plan)
        self._require_same_joints(experiment, settings)
        require_within_limits(driven, settings)
        carried = self._carried(experiment, settings, payload)
        folder = self._experiments.folder(experiment)
        version = ModelStory(folder).read().required(model)
        asked = ProofSettings(
            experiment=experiment,
            rig=rig,
            plan=plan,
            payload=carried,
            model=version.model,
            add=tuple(version.add),
            version=version.id,
            part=part,
            share=share,
            operator=user.name,
            created=datetime.fromtimestamp(self._clock(), UTC).isoformat(timespec="seconds"),
            drives=drive_digests(settings),
        )

        def arguments() -> Arguments:
            return {
                "experiment": str(folder),
                "model": version.model,
                "add": version.add,
                "rig": settings,
                "plan": driven,
                "payload": carried,
                "part": part,
                "share": share,
            }

        def store(ahead: TorqueAhead) -> JobResult:
            with self._lock:
                proof = Proof(next_folder(folder), asked, settings, driven, ahead).store()
            return JobResult(model=version.id, proof=proof.name)

        return self._jobs.submit(
            "compensate",
            COMPUTATION,
            arguments,
            store,
            user=user.name,
            experiment=experiment,
            asked=(settings, asked.model_copy(update={"created": ""})),
        )

    def standard_plan(self, experiment: str, rig: str) -> str:
        """Store a plan that is made for no model in particular, as the command line takes one; returns its id.

        Raises the problem 404 (experiment, rig), InputError where the rig has not the experiment's joints.
        """
        settings = self._rigs.rig(rig)
        self._require_same_joints(experiment, settings)
        return self._plans.add(standard_plan(settings, STANDARD_PLAN_SECONDS, name=f"standard, {rig}"))

    def all(self, experiment: str) -> list[ProofState]:
        """All proofs that can be read, the newest first. Raises the problem 404."""
        return self.listed(experiment)[0]

    def listed(self, experiment: str) -> tuple[list[ProofState], list[str]]:
        """All proofs that can be read, the newest first, and what is wrong with each of the others, which hides none.

        Raises the problem 404.
        """
        states: list[ProofState] = []
        damaged: list[str] = []
        for folder in reversed(proof_folders(self._experiments.folder(experiment))):
            if not _readable(folder):
                continue
            try:
                states.append(self._state(experiment, folder))
            except (InputError, OSError) as error:
                what = self._experiments.shown(str(error))
                damaged.append(
                    f"Proof {folder.name} cannot be read: {what}. Put its folder back from a backup."
                )
        return states, damaged

    def get(self, experiment: str, number: str) -> ProofState:
        """One of them. Raises the problem 404."""
        return self._state(experiment, self._folder(experiment, number))

    def errors(self, experiment: str, number: str) -> FollowingErrors | None:
        """Its following errors cycle by cycle; None until feedforward torque was sent. Raises the problem 404."""
        return read_errors(self._folder(experiment, number))

    def progress(self, experiment: str, number: str) -> str:
        """A text that changes whenever a drive goes a step further or something came of it."""
        state = self.get(experiment, number)
        drives = [row.state if row is not None else "" for row in (state.without, state.with_)]
        compared = "" if state.result is None else state.result.recording_with
        unfinished = "" if state.unfinished is None else state.unfinished.recording
        return "|".join([*drives, compared or "", unfinished])

    def words(self, experiment: str, number: str) -> tuple[str, ...]:
        """What the second drive sends and when it is stopped, joint by joint; none before the first was driven."""
        state = self.get(experiment, number)
        if state.without is None or state.without.file is None or not _done(state.without):
            return ()
        return tuple(self._proof(experiment, number).words(self._recording(state.without)))

    def remarks(self, experiment: str, number: str) -> tuple[str, ...]:
        """What is to be known of what is sent, before it is."""
        remarks = self._proof(experiment, number).ahead.remarks
        if self.get(experiment, number).elsewhere:
            begun = (
                "the run without feedforward torque was driven from the command line; drive the second there with"
                f" coulomb compensate … --continue {number}, or both here"
            )
            return (begun, *remarks)
        return remarks

    def prepare_drive(self, experiment: str, number: str, drive: Drive, user: User) -> SessionRow:
        """A session for one of a proof's drives: check, weigh, confirm, arm and start it as any other. One that is being
        prepared is given again.

        Raises the problem 404, and 409 where that drive is not the next.
        """
        state = self.get(experiment, number)
        there = state.drive(drive)
        if there is not None and not SessionState(there.state).ended and not self.cut_off(there):
            self._operators.take(there.rig or state.settings.rig, user)
            return there
        if state.next is None:
            raise Problem(409, "Both runs of this proof are complete; prepare another proof.")
        if drive != state.next:
            raise Problem(
                409,
                "Run the plan without feedforward torque first: its following error bounds that of the second run."
                if drive == "with"
                else "The plan was run without feedforward torque already; continue with the second run.",
            )
        settings = self._rigs.rig(state.settings.rig)
        self._require_same_joints(experiment, settings)
        proof = self._proof(experiment, number)
        proof.require_prepared_for(settings)
        if drive == "with" and state.without is not None:
            proof.require_torque_as_measured(self._recording(state.without))
        self._operators.take(state.settings.rig, user)
        close_unfinished(proof.folder)
        row = SessionRow(
            experiment=experiment,
            id=drive_id(number, drive),
            file=None,
            payload=state.settings.payload,
            weighed=None,
            role="validation",
            rig=state.settings.rig,
            plan=state.settings.plan,
            state=SessionState.NEW.value,
            reason=None,
            created=self._clock(),
        )
        self._experiments.change_session(row)
        return row

    def cut_off(self, row: SessionRow) -> bool:
        """Whether the service ended while a drive was recorded."""
        if row.file is None or SessionState(row.state).ended or self._has_its_bus(row):
            return False
        from daq.recovery import being_written

        return not being_written(self._recording(row))

    def _has_its_bus(self, row: SessionRow) -> bool:
        holder = self._claims.holder(row.rig or "")
        return isinstance(holder, ActiveSession) and (holder.experiment, holder.id) == (
            row.experiment,
            row.id,
        )

    # --- for the sessions

    def driven(self, row: SessionRow) -> tuple[Path, ExcitationPlan, SentAhead | None]:
        """Where a drive is recorded, its plan, and its feedforward torque."""
        number, drive = _drive(row)
        proof = self._proof(row.experiment, number)
        rig, before = self._rigs.rig(proof.settings.rig), proof.settings.payload
        proof.require_prepared_for(rig)
        now = self._carried(row.experiment, rig, before.name)
        if now.model_dump() != before.model_dump():
            raise InputError(
                f"payload: {now.name} changed since the proof was prepared ({before.mass} kg, now {now.mass} kg); prepare another"
                " proof"
            )
        if drive == "without":
            return proof.folder, proof.plan, proof.first()
        without = self._experiments.drive(row.experiment, number, "without")
        if without is None or not _done(without):
            raise Problem(409, "Run the plan without feedforward torque first.")
        return proof.folder, proof.plan, proof.sent(self._recording(without))

    def files_of_motion(self, row: SessionRow) -> list[Path]:
        """The files that say what a drive of a proof sends."""
        folder = self._folder(row.experiment, _drive(row)[0])
        return [folder / PLAN, folder / AHEAD]

    def conclude(self, row: SessionRow) -> None:
        """A drive has ended: once feedforward torque was sent, compare."""
        number, drive = _drive(row)
        without = self._experiments.drive(row.experiment, number, "without")
        if drive == "without" or row.file is None or without is None or not _done(without):
            return
        reason = self._experiments.shown(row.reason or "")
        proof = self._proof(row.experiment, number)
        proof.conclude(self._recording(without), self._recording(row), _done(row), reason)

    # --- inside

    def _state(self, experiment: str, folder: Path) -> ProofState:
        number = folder.name
        without, with_ = (self._experiments.drive(experiment, number, each) for each in ("without", "with"))
        result = read_conclusion(folder)
        if with_ is not None and with_.file is not None and SessionState(with_.state).ended:
            recorded = Path(with_.file).name
            if result is None or result.recording_with != recorded:  # the service ended before it compared
                self.conclude(with_)
                result = read_conclusion(folder)
        elsewhere = without is None and result is None and first_recording(folder) is not None
        under_way = any(row is not None and self._has_its_bus(row) for row in (without, with_))
        unfinished = None if under_way else unfinished_run(folder)
        return ProofState(number, read_settings(folder), without, with_, result, elsewhere, unfinished)

    def _folder(self, experiment: str, number: str) -> Path:
        for folder in proof_folders(self._experiments.folder(experiment)):
            if folder.name == number and _readable(folder):
                return folder
        raise not_found(f"proof of {experiment}", number)

    def _proof(self, experiment: str, number: str) -> Proof:
        folder = self._folder(experiment, number)
        try:
            # What was driven is compared by the rig that it was driven on, whatever its file says now.
            rig = prepared_rig(folder) or self._rigs.rig(read_settings(folder).rig)
            return Proof.load(folder, rig)
        except InputError as error:
            raise InputError(self._experiments.shown(str(error))) from error

    def _carried(self, experiment: str, rig: Rig, name: str) -> Payload:
        """The payload of that name of the experiment, else of the rig. Raises InputError where neither has it."""
        declared = {each.name: each for each in self._experiments.declared(experiment).payloads}
        return declared.get(name) or rig.payload(name)

    def _recording(self, row: SessionRow) -> Path:
        return self._experiments.folder(row.experiment) / (row.file or "")

    def _require_same_joints(self, experiment: str, rig: Rig) -> None:
        joints = [joint.name for joint in self._experiments.declared(experiment).robot.joints]
        if [axis.joint for axis in rig.axes] != joints:
            raise InputError(f"rig: {rig.name} does not have the experiment's joints ({', '.join(joints)})")


def _readable(folder: Path) -> bool:
    """Whether it says what it is a proof of; proofs of the first version did not."""
    return (folder / "proof.json").is_file()


def _done(row: SessionRow | None) -> bool:
    return row is not None and row.state == SessionState.DONE.value and row.file is not None


def _drive(row: SessionRow) -> tuple[str, Drive]:
    drive = drive_of_proof(row)
    assert drive is not None
    return drive
