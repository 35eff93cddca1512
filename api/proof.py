"""One proof on the drive as it is kept: what is sent along which plan, both recordings, and what came of them.

compensation/00/proof.json            what is proved, and who asked
compensation/00/plan.json, ahead.npz  the plan, and what is sent along it
compensation/00/rig.json              the rig that both were made for
compensation/00/session-00.h5 …       its drives, listed in an experiment.yaml of their own as validation sessions
compensation/00/compensation.json     the following errors, once both drives have ended
compensation/00/errors.npz            the same cycle by cycle, which pictures are drawn from
"""

import io
import json
import shutil
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, Self
from zipfile import BadZipFile

import h5py
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from api.following_parts import compared
from api.model_agreement import ModelTorque, disagreements
from daq.commanded_torque import commanded_torque
from daq.excitation.excitation_plan import ExcitationPlan
from daq.files_as_read import changed_drive
from daq.following_error import FollowingError, following_error
from daq.plan_setpoints import plan_counts
from daq.rig import Rig
from daq.torque_loop import TorqueLoop
from daq.torque_offset import SentAhead, TorqueOffset
from identify.recording import load_experiment
from identify.recording.atomic_file import write_atomically
from identify.recording.errors import InputError
from identify.recording.experiment_file import Payload
from identify.recording.first_fault import first_fault
from identify.results.compensation import CompensationDocument
from identify.results.document import Json
from identify.results.reading import read_document

Array = NDArray[np.float64]
Part = Literal["whole", "friction"]

FOLDER = "compensation"
"""inside the experiment's folder; a folder for each proof, which is an experiment of its own with two validation sessions"""
SETTINGS, PLAN, AHEAD, RIG = "proof.json", "plan.json", "ahead.npz", "rig.json"
_LOOP = "loop_"
_EXPECTED = ("kilogram", "error")
DOCUMENT, ERRORS = "compensation.json", "errors.npz"


@dataclass(frozen=True)
class TorqueAhead:
    """What is sent along a plan, and the motion that it belongs to; a row for each cycle.

    offset                : as the drives take it
    torque                : (L, n) N m or N, what the model asks for, before it is bounded and faded
    position, speed, load : (L, n) rad, rad/s, N m (m, m/s, N) as planned, at the middle of the interval in which the torque
                            acts; the load is the rigid robot's torque, tau_out of eq. (6)
    remarks               : what the reader must know
    loop                  : the position loop of this computer that holds the axes in both drives; None where the drives' own do
    kilogram              : (L, n) N m or N that another kilogram of payload would add; None in a proof of an earlier version
    error                 : (n,) N m or N, root mean square that the model's torque may be off; None as above
    """

    offset: TorqueOffset
    torque: Array
    position: Array
    speed: Array
    load: Array
    remarks: tuple[str, ...]
    loop: TorqueLoop | None = None
    kilogram: Array | None = None
    error: Array | None = None

    def to_bytes(self) -> bytes:
        """As a NumPy archive."""
        written = io.BytesIO()
        np.savez_compressed(
            written,
            counts=self.offset.counts,
            largest=self.offset.largest,
            bounded=self.offset.bounded,
            torque=self.torque,
            position=self.position,
            speed=self.speed,
            load=self.load,
            remarks=np.array(json.dumps(self.remarks)),
            **(
                {}
                if self.loop is None
                else {f"{_LOOP}{name}": held for name, held in vars(self.loop).items()}
            ),
            **{name: held for name in _EXPECTED if (held := getattr(self, name)) is not None},
        )
        return written.getvalue()

    @classmethod
    def load_file(cls, file: Path) -> Self:
        """What `to_bytes` gave."""
        with np.load(file, allow_pickle=False) as held:
            offset = TorqueOffset(held["counts"], held["largest"], held["bounded"])
            remarks = tuple(json.loads(str(held["remarks"])))
            of_loop = {name.removeprefix(_LOOP): held[name] for name in held.files if name.startswith(_LOOP)}
            loop = TorqueLoop(**of_loop) if of_loop else None
            expected = {name: held[name] for name in _EXPECTED if name in held.files}
            wanted = {name: held[name] for name in ("torque", "position", "speed", "load")}
            return cls(offset, **wanted, remarks=remarks, loop=loop, **expected)


class ProofSettings(BaseModel):
    """What is proved and who asked.

    rig, plan : as the service or the command line names them
    version   : of the experiment's model story; None for a model that was named on the command line
    """

    model_config = ConfigDict(frozen=True)

    format: Literal[1] = 1
    experiment: str
    rig: str
    plan: str
    payload: Payload
    model: str
    add: tuple[str, ...] = ()
    version: str | None = None
    part: Part
    share: float
    operator: str
    created: str
    drives: tuple[str, ...] = ()
    """of each axis's drive profile and object dictionary when the proof was prepared (`daq.files_as_read.drive_digests`); empty
    in those of earlier versions"""


@dataclass(frozen=True)
class FollowingErrors:
    """Both drives' following errors, which the picture is drawn from.

    time, position     : (M,) s, (M, n) rad or m of the plan
    before, after      : (M, n) rad or m, without and with feedforward torque; NaN where there is none
    """

    time: Array
    position: Array
    before: Array
    after: Array


@dataclass(frozen=True)
class Proof:
    """One proof in its folder."""

    folder: Path
    settings: ProofSettings
    rig: Rig
    plan: ExcitationPlan
    ahead: TorqueAhead

    @property
    def name(self) -> str:
        """Its number as its folder is called."""
        return self.folder.name

    def store(self) -> Self:
        """Write what is to be done, so that both drives send the same whenever they are driven; the proof in the folder it got.

        That is another one where somebody else's proof has taken this number meanwhile: nobody writes into it.

        Raises InputError where it cannot be written, as on a full disk; nothing is left of it then.
        """
        try:
            kept = replace(self, folder=_claimed(self.folder))
        except OSError as error:
            raise _not_written(self.folder, error) from error
        try:
            write_atomically(kept.folder / PLAN, self.plan.to_json().encode())
            write_atomically(kept.folder / AHEAD, self.ahead.to_bytes())
            write_atomically(kept.folder / RIG, self.rig.model_dump_json().encode())
            write_atomically(kept.folder / SETTINGS, self.settings.model_dump_json(indent=1).encode())
        except OSError as error:
            remove_proof(kept.folder)
            raise _not_written(kept.folder, error) from error
        return kept

    @classmethod
    def load(cls, folder: Path, rig: Rig) -> Self:
        """A stored one. Raises InputError where a file of it was damaged."""
        settings = read_settings(folder)
        try:
            ahead = TorqueAhead.load_file(folder / AHEAD)
        except (OSError, KeyError, ValueError, BadZipFile) as error:
            raise InputError(f"{folder / AHEAD}: cannot be read ({error}); prepare another proof") from error
        return cls(folder, settings, rig, ExcitationPlan.load(folder / PLAN), ahead)

    def error(self, recording: Path | None) -> FollowingError:
        """Of one of the drives; without rows where nothing was recorded."""
        if recording is None or not recording.exists():
            n = len(self.rig.axes)
            return FollowingError(np.zeros(0, np.int64), np.zeros((0, n)))
        return following_error(recording, plan_counts(self.rig, self.plan))

    def limits(self, without: FollowingError) -> Array:
        """(n,) rad or m: following error at which the drive with feedforward torque is stopped: twice the peak without it."""
        return following_limits(self.rig, without)

    def first_run(self) -> Path:
        """The recording of the run without feedforward torque, which was driven to its end.

        Raises InputError: it was not, or both runs were.
        """
        result = read_conclusion(self.folder)
        if result is not None and result.completed:
            raise InputError(f"proof {self.name}: both runs are complete; prepare another proof")
        first = first_recording(self.folder)
        if first is None:
            raise InputError(
                f"proof {self.name}: the run without feedforward torque did not come to its end; prepare another proof"
            )
        return first

    def require_same_rig(self, without: Path) -> None:
        """Raises InputError: the rig file was changed since the first run, so that the second would not be the same."""
        with h5py.File(without, "r") as file:
            before = json.loads(str(file.attrs["rig"]))
        _require_same(self.rig, before, "the run without feedforward torque")

    def require_prepared_for(self, rig: Rig) -> None:
        """Raises InputError: `rig` is not the one that the torque was computed for; its file was changed since, or that of a
        drive."""
        then = prepared_rig(self.folder)
        if then is not None:
            _require_same(rig, json.loads(then.model_dump_json()), "the proof was prepared")
        changed = changed_drive(rig, self.settings.drives) if self.settings.drives else ""
        if changed:
            raise InputError(
                f"rig {rig.name}, {changed} changed since the proof was prepared; prepare another proof"
            )

    def require_torque_as_measured(self, without: Path) -> None:
        """Raises InputError: the first run gave another torque than the model's, or of another payload; the proof keeps why."""
        ahead = self.ahead
        if ahead.kilogram is None or ahead.error is None:
            return
        given = commanded_torque(without, plan_counts(self.rig, self.plan), self.rig.drive_gain)
        beside = ahead.torque if self.settings.part == "friction" else ahead.torque - ahead.load
        at = given.cycle
        mass = self.settings.payload.mass
        model = ModelTorque(ahead.load[at], beside[at], ahead.kilogram[at], ahead.error, mass)
        reasons = disagreements(given.torque, model, [axis.joint for axis in self.rig.axes])
        if reasons:
            others = "" if len(reasons) == 1 else f" ({len(reasons) - 1} more like it)"
            reason = f"the model's torque was not sent: {reasons[0]}{others}"
            self.conclude(without, None, completed=False, reason=reason)
            raise InputError(reason)

    def first(self) -> SentAhead:
        """What the first drive sends: nought as torque, or where this computer's loop holds the axes its torque alone.

        Nought is sent rather than nothing, so that a drive which takes no torque there refuses before the first run, and both are
        the same but for the torque.
        """
        counts = self.ahead.offset.counts
        unknown = np.full(counts.shape, np.nan)
        return SentAhead(np.zeros_like(counts), np.full(counts.shape[1], np.inf), unknown, self.ahead.loop)

    def sent(self, without: Path) -> SentAhead:
        """What the second drive sends, its following error bounded by that of the first, which was driven to its end.

        Raises InputError: the rig is not what it was, or the first drive gave another torque than the model's.
        """
        self.require_same_rig(without)
        self.require_prepared_for(self.rig)
        self.require_torque_as_measured(without)
        error, counts = self.error(without), self.ahead.offset.counts
        return SentAhead(counts, self.limits(error), error.over(len(counts)), self.ahead.loop)

    def words(self, without: Path) -> list[str]:
        """What the second drive sends, joint by joint, for the operator."""
        limits = self.limits(self.error(without))
        return [
            f"{axis.joint} up to {largest:.3g} A of feedforward, stopped at a following error of {1e3 * limit:.3g}"
            f" {'mm' if joint.type == 'prismatic' else 'mrad'}"
            for axis, joint, largest, limit in zip(
                self.rig.axes, self.rig.robot.joints, self.ahead.offset.largest, limits, strict=True
            )
        ]

    def conclude(
        self, without: Path, with_: Path | None, completed: bool, reason: str
    ) -> CompensationDocument:
        """What came of both drives, stored with their recordings.

        with_     : None where the second recorded nothing
        completed : whether it was driven to its end
        reason    : why it ended
        """
        before, after = self.error(without), self.error(with_)
        settings = self.settings
        document = CompensationDocument(
            experiment=settings.experiment,
            rig=self.rig.name,
            payload=settings.payload.name,
            model=settings.model,
            add=settings.add,
            part=settings.part,
            share=settings.share,
            recording_without=without.name,
            recording_with=None if with_ is None else with_.name,
            completed=completed,
            reason=reason,
            following_limits=tuple(float(limit) for limit in self.limits(before)),
            joints=compared(self.rig, self.ahead.offset, self.ahead.speed, self.ahead.load, before, after),
            folder=f"{FOLDER}/{self.name}",
            operator=settings.operator,
            created=settings.created,
            remarks=self.ahead.remarks,
            held_by="drive" if self.ahead.loop is None else "this computer",
        )
        write_atomically(self.folder / ERRORS, self._errors(before, after))
        write_atomically(self.folder / DOCUMENT, (document.json_text(indent=1) + "\n").encode())
        return document

    def _errors(self, before: FollowingError, after: FollowingError) -> bytes:
        cycles = len(self.ahead.position)
        written = io.BytesIO()
        np.savez_compressed(
            written,
            time=np.arange(cycles) * self.rig.cycle,
            position=self.ahead.position.astype(np.float32),
            before=before.over(cycles).astype(np.float32),
            after=after.over(cycles).astype(np.float32),
        )
        return written.getvalue()


def _require_same(rig: Rig, before: Json, since: str) -> None:
    now = json.loads(rig.model_dump_json())
    changed = [name for name in now if now[name] != before.get(name)]
    if changed:
        raise InputError(f"rig {rig.name}: {', '.join(changed)} changed since {since}; prepare another proof")


def prepared_rig(folder: Path) -> Rig | None:
    """The rig that a proof's torque was computed for; None for one of an earlier version. Raises InputError where damaged."""
    file = folder / RIG
    try:
        return Rig.model_validate_json(file.read_bytes())
    except FileNotFoundError:
        return None
    except ValidationError as error:
        raise InputError(f"{file}: cannot be read; prepare another proof") from error


def following_limits(rig: Rig, without: FollowingError) -> Array:
    """(n,) rad or m: following error at which a drive with feedforward torque is stopped: twice the peak without it.

    Raises InputError: nothing of the plan was driven without it.
    """
    if not len(without.cycle):
        raise InputError("the run without feedforward torque recorded nothing of the plan; run it again")
    stated = np.array([axis.limits.following_error for axis in rig.axes])
    resolution = np.abs(rig.position_matrix).sum(axis=1)
    return np.minimum(stated, 2.0 * without.peak() + 2.0 * resolution)


def next_folder(experiment: Path) -> Path:
    """The folder of an experiment's next proof; not made yet."""
    taken = [int(path.name) for path in proof_folders(experiment)]
    return experiment / FOLDER / f"{max(taken, default=-1) + 1:02d}"


def _claimed(folder: Path) -> Path:
    """A folder that did not exist before: this one, or the next that is free."""
    while True:
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            folder = folder.with_name(f"{int(folder.name) + 1:02d}")
        else:
            return folder


def _not_written(folder: Path, error: OSError) -> InputError:
    return InputError(f"{folder}: the proof cannot be written: {error.strerror}; nothing moved")


def remove_proof(folder: Path) -> None:
    """Remove the folder of a proof in which nothing was recorded."""
    shutil.rmtree(folder, ignore_errors=True)
    with suppress(OSError):  # other proofs stand beside it
        folder.parent.rmdir()


def proof_folders(experiment: Path) -> list[Path]:
    """Folders of an experiment's proofs, in their order."""
    folders = [path for path in (experiment / FOLDER).glob("[0-9]*") if path.name.isdecimal()]
    return sorted(folders, key=lambda path: int(path.name))


def first_recording(folder: Path) -> Path | None:
    """The recording of a proof's run without feedforward torque; None where it was not driven to its end."""
    if not (folder / "experiment.yaml").is_file():
        return None
    return next((entry.path for entry in load_experiment(folder).sessions if _is_complete(entry.path)), None)


def _is_complete(recording: Path) -> bool:
    """Whether a recording was driven to its end; one that was stopped may be listed all the same once it was recovered."""
    with h5py.File(recording, "r") as file:
        return str(file.attrs["status"]) == "complete"


def read_settings(folder: Path) -> ProofSettings:
    """What a proof is of. Raises InputError where its file was damaged, FileNotFoundError where there is none."""
    file = folder / SETTINGS
    try:
        return ProofSettings.model_validate_json(file.read_bytes())
    except ValidationError as error:
        raise InputError(f"{file}: {first_fault(error)}") from error


def read_conclusion(folder: Path) -> CompensationDocument | None:
    """What came of a proof; None while its drives are not both over. Raises InputError where its file was damaged."""
    try:
        return read_document(CompensationDocument, folder / DOCUMENT)
    except FileNotFoundError:
        return None


def read_errors(folder: Path) -> FollowingErrors | None:
    """The following errors of a proof cycle by cycle; None where they were not kept. Raises InputError where damaged."""
    file = folder / ERRORS
    try:
        with np.load(file, allow_pickle=False) as held:
            named = (held[name] for name in ("time", "position", "before", "after"))
            return FollowingErrors(*(np.asarray(values, np.float64) for values in named))
    except FileNotFoundError:
        return None
    except (OSError, KeyError, ValueError, BadZipFile) as error:
        raise InputError(f"{file}: cannot be read ({error})") from error
