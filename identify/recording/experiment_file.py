"""The file `experiment.yaml`: robot, payloads and sessions, checked field by field."""

from __future__ import annotations

import difflib
import os
import re
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)

from identify.recording.atomic_file import write_atomically
from identify.recording.errors import InputError
from identify.recording.plain_text import Name, Printable
from identify.recording.possible_inertia import check_inertia
from identify.recording.strict_yaml import Lines, read_strict_yaml, strict_yaml_text

EXPERIMENT_FILE = "experiment.yaml"

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0)]
NotNegative = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0)]
_Model = TypeVar("_Model", bound=BaseModel)
MOST_JOINTS = 64
"""Of one chain; which of its parameters can be identified takes memory with the third power of their number."""
Inertia = tuple[Number, Number, Number, Number, Number, Number]
Word = Annotated[Printable, Field(min_length=1)]


def _whole(value: Any) -> Any:
    """The version of the format is a whole number, which `true` and `1.0` only equal."""
    return value if type(value) is int else str(value)


class _Settings(BaseModel):
    # Deferred: what checks a part is made when a part is made alone; reading a file makes one check of the whole.
    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


class JointLimits(_Settings):
    """What the joint may do; each field optional. Used by the planner and the safety monitor."""

    position: tuple[Number, Number] | None = None
    """Lowest and highest position, rad or m."""
    velocity: Positive | None = None
    """Highest speed, rad/s or m/s."""
    acceleration: Positive | None = None
    """Highest acceleration, rad/s² or m/s²."""

    @model_validator(mode="after")
    def _ordered(self) -> JointLimits:
        if self.position is not None and self.position[0] >= self.position[1]:
            raise ValueError("position: the lower limit must come first, [lowest, highest]")
        return self


class Joint(_Settings):
    """One joint; modified Denavit-Hartenberg (Khalil-Kleinfinger) of its frame in the frame before."""

    name: Name
    type: Literal["revolute", "prismatic"]
    alpha: Number = 0.0
    """rad"""
    d: Number = 0.0
    """m"""
    theta: Number = 0.0
    """rad; the constant offset added to q for a revolute joint."""
    r: Number = 0.0
    """m; the constant offset added to q for a prismatic joint."""
    drive_gain: Number | None = None
    """g_f of eq. (7): joint torque (N m) or force (N) per unit of the recorded command."""
    motor_ratio: Number = 1.0
    """Motor turns per joint turn."""
    limits: JointLimits | None = None

    @property
    def revolute(self) -> bool:
        """Whether the joint turns (and does not slide)."""
        return self.type == "revolute"


class Robot(_Settings):
    """A serial robot, joints from base to tip."""

    gravity: tuple[Number, Number, Number]
    """m/s², in the base frame."""
    joints: Annotated[tuple[Joint, ...], Field(min_length=1)]
    drive_gain_matrix: tuple[tuple[Number, ...], ...] | None = None
    """(n, n): joint torques = matrix @ v, instead of the joints' scalars, for coupled transmissions."""

    @model_validator(mode="after")
    def _consistent(self) -> Robot:
        names = [joint.name for joint in self.joints]
        if len(names) > MOST_JOINTS:
            raise ValueError(
                f"joints: {len(names)} are given, at most {MOST_JOINTS} can be identified together"
            )
        for index, name in enumerate(names):
            if name in names[:index]:
                raise ValueError(f"joints: the name '{name}' is given to two joints; names must differ")
        n = len(names)
        matrix = self.drive_gain_matrix
        if matrix is None:
            for index, joint in enumerate(self.joints):
                if joint.drive_gain is None:
                    raise ValueError(
                        f"joints[{index}]: 'drive_gain' of '{joint.name}' is missing: torque per unit of"
                        " command; or give drive_gain_matrix"
                    )
                if joint.drive_gain == 0:
                    raise ValueError(f"joints[{index}].drive_gain: is 0, so no torque would be measured")
            return self
        for index, joint in enumerate(self.joints):
            if joint.drive_gain is not None:
                raise ValueError(
                    f"joints[{index}].drive_gain: remove it, or drive_gain_matrix; only one of them may be given"
                )
        if len(matrix) != n or any(len(row) != n for row in matrix):
            shape = f"{len(matrix)} rows of {sorted({len(row) for row in matrix})} values"
            raise ValueError(
                f"drive_gain_matrix: must be {n} rows of {n} values (one per joint), not {shape}"
            )
        if not all(any(row) for row in matrix) or not all(
            any(column) for column in zip(*matrix, strict=True)
        ):
            raise ValueError(
                "drive_gain_matrix: a row or a column is all zero, so a joint would have no drive"
            )
        return self


class Payload(_Settings):
    """A known body fixed to the last link, in the last link's frame."""

    name: Name
    mass: NotNegative
    """kg"""
    com: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)
    """Centre of mass, m."""
    inertia: Annotated[Inertia, AfterValidator(check_inertia)] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """About the centre of mass: XX XY XZ YY YZ ZZ, kg m²."""


class LinkBody(_Settings):
    """A link with all that is fixed to it, in the frame of its joint."""

    mass: NotNegative
    """kg"""
    com: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)
    """Centre of mass, m."""
    inertia: Inertia = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """About the centre of mass: XX XY XZ YY YZ ZZ, kg m²."""


class PriorBodies(_Settings):
    """The links as a file of the robot or a drawing states them; what is identified is shown beside them."""

    source: Word
    """Where they are from: the file's name."""
    links: Annotated[tuple[LinkBody, ...], Field(min_length=1)]
    """One for each joint, base to tip."""
    remarks: tuple[Printable, ...] = ()
    """What was decided while the file was read."""


class DeclaredSession(_Settings):
    """One line of `sessions`: a file of samples and the payload that was carried."""

    file: Word
    payload: Name
    role: Literal["identification", "validation"] = "identification"
    excluded: Word | None = None
    """Why no model is to use the session; None where it takes part in its role."""


class SignalCutoffs(_Settings):
    """Cut-offs set by the user; what is left out is chosen from the data by the rule of
    `identify.signals.cutoff`."""

    position_cutoff: Positive | tuple[Positive, ...] | None = None
    """Hz; of the zero-phase low-pass on the positions, one value or one for each joint."""
    decimation_cutoff: Positive | None = None
    """Hz; of the parallel low-pass on torque and regressor."""


class ExperimentFile(_Settings):
    """The whole of `experiment.yaml`."""

    format: Annotated[Literal[1], BeforeValidator(_whole)]
    name: Name
    robot: Robot
    payloads: Annotated[tuple[Payload, ...], Field(min_length=1)]
    sessions: tuple[DeclaredSession, ...] = ()
    signals: SignalCutoffs = (
        SignalCutoffs.model_construct()
    )  # not checked: importing would make the check of the part alone
    effects: tuple[Word, ...] = ()
    """Files of the user's own effects, relative to the experiment's folder."""
    prior: PriorBodies | None = None
    """Nothing is fitted to them."""

    @model_validator(mode="after")
    def _consistent(self) -> ExperimentFile:
        payloads = [payload.name for payload in self.payloads]
        for index, name in enumerate(payloads):
            if name in payloads[:index]:
                raise ValueError(f"payloads[{index}].name: '{name}' is declared twice; names must differ")
        files: set[str] = set()
        for index, session in enumerate(self.sessions):
            if session.payload not in payloads:
                raise ValueError(
                    f"sessions[{index}].payload: '{session.payload}' is not declared;"
                    f" payloads are {', '.join(payloads)}"
                )
            file = os.path.normpath(session.file)
            if file in files:
                raise ValueError(f"sessions[{index}].file: '{session.file}' is listed twice; keep one")
            files.add(file)
        cutoff, n = self.signals.position_cutoff, len(self.robot.joints)
        if isinstance(cutoff, tuple) and len(cutoff) != n:
            raise ValueError(
                f"signals.position_cutoff: has {len(cutoff)} values for {n} joints; give one, or {n}"
            )
        if self.prior is not None and len(self.prior.links) != n:
            raise ValueError(
                f"prior.links: has {len(self.prior.links)} bodies for {n} joints; give one for each"
            )
        return self


def read_experiment_file(path: Path) -> ExperimentFile:
    """Read and check an `experiment.yaml`.

    Raises InputError: with one line that names file, line and field, and what would be right.
    """
    document, lines = read_strict_yaml(path)
    return check_settings(ExperimentFile, document, lines, path)


def check_settings(model: type[_Model], document: Any, lines: Lines, path: Path | str) -> _Model:
    """Check a YAML document against a pydantic model.

    Raises InputError: with one line that names file, line and field of the first mistake.
    """
    if not isinstance(document, dict):
        needed = ", ".join(name for name, field in model.model_fields.items() if field.is_required())
        raise InputError(f"{path}: holds no fields; {needed} are needed")
    try:
        return model.model_validate(document)
    except ValidationError as error:
        raise InputError(_first_mistake(error, model, lines, path)) from None


def _first_mistake(error: ValidationError, model: type[BaseModel], lines: Lines, path: Path | str) -> str:
    # An unknown key is reported before a missing one: it is most often the missing one, misspelt.
    mistake = min(error.errors(include_url=False), key=lambda mistake: mistake["type"] != "extra_forbidden")
    place, text = tuple(mistake["loc"]), mistake["msg"]
    if mistake["type"] == "value_error":
        text = text.removeprefix("Value error, ")
        named = re.match(r"([a-z_]+(?:\[\d+\]|\.[a-z_]+)*): ", text)
        if named:
            inner = re.findall(r"[a-z_]+|\d+", named[1])
            place += tuple(int(part) if part.isdigit() else part for part in inner)
            text = text[named.end() :]
    elif mistake["type"] == "extra_forbidden":
        text = "unknown field" + _meant(str(place[-1]), _fields_at(model, place[:-1]))
    elif mistake["type"] == "missing":
        text = "is missing"
    elif mistake["type"] == "tuple_type":
        text = f"must be a list, [...], not {_shown(mistake['input'])}"
    elif mistake["type"] == "too_short":  # of lists that must not be empty
        text = "at least 1 is needed, none is given"
    else:
        text = f"{text[0].lower()}{text[1:]}, not {_shown(mistake['input'])}"
    # Pydantic names branches of a union too, which are not places in the file.
    while lines and place and place not in lines:
        if mistake["type"] == "missing" and place[:-1] in lines:
            line = lines[place[:-1]]
            return f"{path} line {line}: {_field_name(place)}: {text}"
        place = place[:-1]
    line = f" line {lines[place]}" if place in lines else ""
    return f"{path}{line}: {_field_name(place) + ': ' if place else ''}{text}"


def _field_name(place: tuple[str | int, ...]) -> str:
    name = ""
    for part in place:
        name += f"[{part}]" if isinstance(part, int) else f".{part}" if name else str(part)
    return name


def _fields_at(model: type[BaseModel], place: tuple[str | int, ...]) -> list[str]:
    """Names of the fields of the (nested) model at a place of the document."""
    kind: Any = model
    for part in place:
        if isinstance(part, int):
            continue
        kind = kind.model_fields[part].annotation
        while not (isinstance(kind, type) and issubclass(kind, BaseModel)):
            inner = [
                argument for argument in get_args(kind) if argument is not type(None) and argument is not ...
            ]
            if not inner:
                return []
            kind = inner[0]
    return list(kind.model_fields)


def _meant(key: str, fields: list[str]) -> str:
    near = difflib.get_close_matches(key, fields, 1)
    if near:
        return f"; did you mean '{near[0]}'?"
    return f"; the fields here are {', '.join(fields)}" if fields else ""


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def write_experiment(folder: Path, experiment: ExperimentFile) -> Path:
    """Write `experiment.yaml` into a folder (made if need be), in one step: a reader sees the old or the
    new file.

    Returns the path of the file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / EXPERIMENT_FILE
    document = experiment.model_dump(mode="json", exclude_none=True, exclude_defaults=False)
    for optional in ("signals", "effects"):
        if not document.get(optional):
            document.pop(optional, None)
    text = strict_yaml_text(document, lists_in_line=True)
    write_atomically(path, text.encode())
    return path


def change_session(folder: Path, file: str, **changes: str | None) -> ExperimentFile:
    """Change what `sessions` says of one file (`role`, `excluded`); returns what now stands there.

    Raises InputError: the experiment is not valid, would not be after the change, or lists no such file.
    """
    path = folder / EXPERIMENT_FILE
    experiment = read_experiment_file(path)
    if file not in {session.file for session in experiment.sessions}:
        raise InputError(f"{path}: sessions: '{file}' is not listed")
    document = experiment.model_dump() | {
        "sessions": [
            item.model_dump() | (changes if item.file == file else {}) for item in experiment.sessions
        ],
    }
    changed = check_settings(ExperimentFile, document, {}, path)
    write_experiment(folder, changed)
    return changed


def append_session(folder: Path, session: DeclaredSession, payload: Payload | None = None) -> ExperimentFile:
    """Add one session (and its payload, if it is new) to the experiment in a folder; returns what now
    stands there.

    Raises InputError: the experiment is not valid, or would not be after adding.
    """
    path = folder / EXPERIMENT_FILE
    experiment = read_experiment_file(path)
    payloads = experiment.payloads
    if payload is not None and payload not in payloads:
        payloads = (*payloads, payload)
    document = experiment.model_dump() | {
        "payloads": [item.model_dump() for item in payloads],
        "sessions": [item.model_dump() for item in (*experiment.sessions, session)],
    }
    extended = check_settings(ExperimentFile, document, {}, path)
    write_experiment(folder, extended)
    return extended


def keep_prior(folder: Path, prior: PriorBodies) -> ExperimentFile:
    """Declare the links' bodies in the experiment in a folder, instead of what it declares; returns what now stands there.

    Raises InputError: the experiment is not valid, or they are not one for each joint.
    """
    path = folder / EXPERIMENT_FILE
    document = read_experiment_file(path).model_dump() | {"prior": prior.model_dump()}
    changed = check_settings(ExperimentFile, document, {}, path)
    write_experiment(folder, changed)
    return changed


def append_effect(folder: Path, name: str, content: str) -> Path:
    """Write a user's own effect beside the experiment in a folder, and name it there; returns its file.

    content : the effect, YAML
    Raises InputError: the experiment is not valid, or there is a file of that name.
    """
    experiment = read_experiment_file(folder / EXPERIMENT_FILE)
    path = folder / f"{name}.yaml"
    if path.exists():
        raise InputError(f"{path}: exists already; remove it, or rename it and its line under 'effects'")
    write_atomically(path, content.encode())
    write_experiment(folder, experiment.model_copy(update={"effects": (*experiment.effects, path.name)}))
    return path
