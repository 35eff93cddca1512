"""`export`: a model into a file that somebody else's program takes, and the certificate beside it."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.inverse_dynamics import InverseDynamics
from identify.estimation.context import contexts
from identify.estimation.doubts import predicts_worse
from identify.estimation.small_algebra import single_threaded
from identify.export.bodies import feasible_standard
from identify.export.c_code import c_code, c_name
from identify.export.compiled import compiler_here
from identify.export.exported_model import RIGID, ExportedModel, exported_model
from identify.export.fmu import fmu, platform_name
from identify.export.formula_torque import module_of, module_torque
from identify.export.joint_friction import HAS_ROTORS, joint_parts
from identify.export.link_files import WRITERS, LinkFile, bodies_of, joints_renamed
from identify.export.loaded_back import NotMeasured, loaded_back
from identify.export.model_document import model_document
from identify.export.python_code import python_code
from identify.export.record_error import Motion, RecordError, errors_of_model, errors_on_record
from identify.export.shared_motors import motors_apart, shared_motor_remarks
from identify.export.structured_text import structured_text
from identify.export.tilted_base import tilted_base
from identify.identification import Identification, identify
from identify.recording import Experiment, InputError
from identify.results.certificate import Certificate, JointCertificate

Array = NDArray[np.float64]

KINDS = {
    ".urdf": "URDF",
    ".sdf": "SDF 1.7",
    ".xml": "MJCF",
    ".py": "Python module",
    ".c": "C source and header",
    ".st": "structured text (IEC 61131-3)",
    ".fmu": "FMI 3.0 co-simulation unit",
    ".json": "data (JSON)",
}
"""what each ending of a target means"""

ROUNDING = 1e-6
"""of the torque's root mean square: a difference beyond is none of rounding, save where a load of nought decides on a sign"""

LINEAR_S_ERROR = (
    "the relative error of the model is that of the linear form of eq. (30), in which products of arm and gear are parameters of"
    " their own"
)
NO_VALUE = (
    "a formula has no value somewhere (a root, a logarithm, a quotient); it counts as 0 there, but a controller that stops on an"
    " invalid floating-point operation stops"
)


Parts = Sequence[tuple[Sequence[str], Sequence[str], Sequence[str]]]
"""of each joint the effects that are kept, approximated and lost"""


@dataclass(frozen=True)
class _Export:
    """Contents by file name, and what the format keeps, approximates and loses of each joint.

    gravity : (3,) m/s², of a file that has another than the model's
    """

    files: Mapping[str, str | bytes]
    parts: Parts
    remarks: tuple[str, ...] = ()
    gravity: Array | None = None


@dataclass(frozen=True)
class _Measured:
    """Errors of a written file, joint by joint, and what computed its torques; or why nothing did."""

    errors: Sequence[RecordError]
    by: str
    not_measured: str | None = None


@single_threaded
def export(
    experiment: Experiment, target: Path, model: str = "usual", add: Sequence[str] = ()
) -> Certificate:
    """Identify a model and write it to `target`; beside it `TARGET.certificate.json`.

    target : a file ending in .urdf, .sdf, .xml (MJCF), .py, .c (a header is written beside it), .st, .fmu or .json
    Raises InputError: the ending, the experiment, the model or an effect is wrong, somebody else's file stands there, or the
        extra `feasible` is not installed, which formats with bodies need.
    """
    checked_target(target)
    require_no_other_s_file(target)
    return write_export(identify(experiment, model, add), target)


def checked_target(target: Path) -> str:
    """The ending of a target, in small letters however it is written.

    Raises InputError: there is no such format, no folder to write to, something else than a file stands where one is to be
        written, or C could not include the header.
    """
    ending = target.suffix.lower()
    if ending not in KINDS:
        listed = ", ".join(f"{ending} ({kind})" for ending, kind in KINDS.items())
        raise InputError(f"{target}: a model is written as {listed}")
    folder = target.parent.resolve()
    if not folder.is_dir():
        raise InputError(f"{target}: there is no folder {folder}")
    if not os.access(folder, os.W_OK):
        raise InputError(f"{target}: the folder {folder} cannot be written to")
    if target.suffix == ".C":
        raise InputError(f"{target}: compilers take .C for C++; write {target.with_suffix('.c').name}")
    if ending == ".c" and (not target.stem.isprintable() or set(target.stem) & set('"\\')):
        raise InputError(f"{target}: C cannot include a header of this name; use letters, digits and '_'")
    beside = [_certificate_of(target)]
    if ending == ".c":
        beside.append(target.with_suffix(".h"))
    for written in (target, *beside):
        _require_room_for_a_file(written)
    return ending


def _require_room_for_a_file(file: Path) -> None:
    """Raises InputError: something else than a file stands there, or the name is none. A link is not followed: the certificate
    and the header would not stand beside the file that it leads to."""
    try:
        if file.is_symlink():
            raise InputError(f"{file}: is a link to {file.readlink()}; name the file itself, or another")
        if file.is_dir():
            raise InputError(f"{file}: is a folder, but a file of this name is to be written")
        if file.exists() and not file.is_file():
            raise InputError(f"{file}: is no file, but a file of this name is to be written")
    except OSError as problem:
        raise InputError(f"{file}: cannot be written: {problem.strerror}") from problem


def require_no_other_s_file(target: Path) -> None:
    """Raises InputError: a file stands there that is no export, which has its certificate beside it; a robot's URDF, for
    instance, is not written over."""
    files = [target, *([target.with_suffix(".h")] if target.suffix == ".c" else [])]
    there = [file for file in files if file.is_file() and file.stat().st_size > 0]
    if there and not _certificate_of(target).is_file():
        raise InputError(
            f"{there[0]}: already exists and was not exported by coulomb (it has no certificate); remove it or choose another"
            " name"
        )


def _certificate_of(target: Path) -> Path:
    return target.with_name(f"{target.name}.certificate.json")


def write_export(result: Identification, target: Path) -> Certificate:
    """Write an identified model to `target` and its certificate beside it; both or, on an error, neither.

    Raises InputError: as `checked_target`, the disk is full, or a file is not what it must be.
    """
    ending = checked_target(target)
    model = exported_model(result)
    # Programs that load a file back know its kind by an ending in small letters.
    plain = target.with_suffix(ending)
    if ending.removeprefix(".") in WRITERS:
        made = _link_file(result, model, plain, ending.removeprefix("."))
    else:
        made = _code(model, plain, ending)
    beside = target.parent.resolve()  # programs that load a file back may work in a folder of their own
    try:
        with tempfile.TemporaryDirectory(dir=beside, prefix=".coulomb-export-") as workspace:
            folder = Path(workspace)
            for name, content in made.files.items():
                (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
            measured = _measured(result, model, folder / plain.name, made.gravity)
            certificate = _certificate(result, model, target, made, measured)
            name = _certificate_of(target).name
            (folder / name).write_text(certificate.json_text(indent=1) + "\n", encoding="utf-8")
            for written in (*made.files, name):
                (folder / written).replace(beside / (target.name if written == plain.name else written))
    except OSError as problem:
        raise InputError(f"{target}: cannot be written: {problem.strerror or problem}") from problem
    return certificate


def _measured(result: Identification, model: ExportedModel, file: Path, gravity: Array | None) -> _Measured:
    """Errors of a file on the record.

    gravity : (3,) m/s², if not the model's: a payload is under the file's too

    Raises InputError: the file is not what it must be.
    """
    formulas = module_torque(module_of(model), model)
    geometry = model.geometry if gravity is None else replace(model.geometry, gravity=gravity)
    try:
        with loaded_back(file, geometry) as loaded:
            return _Measured(errors_on_record(result, loaded.torque_of, formulas), loaded.by)
    except NotMeasured as reason:
        return _Measured([RecordError(None, None)] * model.joints, "nothing", str(reason))


def _certificate(
    result: Identification, model: ExportedModel, target: Path, made: _Export, measured: _Measured
) -> Certificate:
    listed = zip(model.geometry.names, made.parts, errors_of_model(result), measured.errors, strict=True)
    joints = tuple(
        JointCertificate(
            joint=joint,
            kept=tuple(kept),
            approximated=tuple(approximated),
            lost=tuple(lost),
            relative_error_model=before,
            relative_error_export=error.relative,
            relative_difference=error.difference,
        )
        for joint, (kept, approximated, lost), before, error in listed
    )
    linear = [LINEAR_S_ERROR] if result.structured is not None and result.form == "linear" else []
    worse = predicts_worse(result.fitted, result.relative_error, result.relative_error_validation)
    return Certificate(
        target=target.name,
        kind=KINDS[target.suffix.lower()],
        experiment=model.experiment,
        model=model.name,
        joints=joints,
        checked_with=measured.by,
        not_measured=measured.not_measured,
        remarks=(
            *model.remarks,
            *([worse] if worse else []),
            *linear,
            *made.remarks,
            *_disagreements(joints),
        ),
    )


def _disagreements(joints: Sequence[JointCertificate]) -> list[str]:
    """Of joints whose file gives other torques than the model, though the format holds all of it."""
    return [
        f"{joint.joint}: the file's torque is {joint.relative_difference:.1%} off the model's, though the format holds all of it"
        for joint in joints
        if joint.relative_difference is not None
        and joint.relative_difference > ROUNDING
        and not (joint.approximated or joint.lost)
    ]


def _code(model: ExportedModel, target: Path, ending: str) -> _Export:
    """Formats that hold every formula."""
    parts = []
    remarks = _on_time(model, ending)
    for joint in range(model.joints):
        kept = dict.fromkeys([RIGID, *(torque.effect for torque in model.torques if torque.row == joint)])
        lost = [effect for effect, place in model.lost if place == joint]
        parts.append((list(kept), [], lost))
    match ending:
        case ".py":
            return _Export({target.name: python_code(model)}, parts, remarks)
        case ".c":
            source, header = c_code(model, target.stem)
            return _Export({target.name: source, f"{target.stem}.h": header}, parts, remarks)
        case ".fmu":
            made = _unit(model, target, parts)
            return replace(made, remarks=(*remarks, *made.remarks))
        case ".st":
            no_value = (NO_VALUE,) if model.may_have_no_value else ()
            return _Export({target.name: structured_text(model, target.stem)}, parts, (*remarks, *no_value))
        case _:
            return _Export({target.name: model_document(model).json_text(indent=1) + "\n"}, parts, remarks)


def _on_time(model: ExportedModel, ending: str) -> tuple[str, ...]:
    """What the user of a file must know of the time that its torque is of."""
    differentiated = [each for each in model.torques if each.derivative]
    remarks = []
    if differentiated and ending != ".json":
        effects = ", ".join(dict.fromkeys(each.effect for each in differentiated))
        remarks.append(
            f"{effects}: derivatives over time are differences between a motion's neighbours, so that the torque comes"
            f" {model.latency} cycle{'s' if model.latency > 1 else ''} after the motion that it is of; give the planned motion so"
            " many cycles ahead, and the period at which it comes"
        )
    for each in differentiated:
        name = model.geometry.names[each.row]
        if each in model.in_order[1] and any(each.values):
            shift = sum(each.values)
            remarks.append(
                f"{each.effect} of {name}: the torque stands {abs(1e3 * shift):.3g} ms {'later' if shift > 0 else 'earlier'} than"
                " without it, as the command does in the record; where that comes of how the record was made (time stamps),"
                " export a model without it"
            )
        if each.memory is not None and each.memory.kind == "play" and any(each.values):
            remarks.append(
                f"{each.effect} of {name}: where the link meets the flank its blow is a pulse of a few cycles, the higher the"
                " shorter the period; bound what a drive is sent of it"
            )
    return tuple(remarks)


def _unit(model: ExportedModel, target: Path, parts: Parts) -> _Export:
    """A functional mock-up unit, with a binary where a compiler makes one."""
    compiler = compiler_here()
    try:
        unit = fmu(model, target.stem, compiler)
    except InputError as refusal:
        return _Export({target.name: fmu(model, target.stem, None)}, parts, (str(refusal),))
    if compiler is None:
        return _Export({target.name: unit}, parts)
    remark = f"the unit has a binary for {platform_name()}, and sources for others"
    return _Export({target.name: unit}, parts, (remark,))


def _link_file(result: Identification, model: ExportedModel, target: Path, kind: str) -> _Export:
    """Formats with bodies, whose friction is damping and dry friction."""
    standard, kept = feasible_standard(result, model, rotors=kind in HAS_ROTORS and model.base.rotors)
    model = model.of_the_instant  # there is no history in these formats
    motions = motions_of(result)
    tilted = tilted_base(model, standard, result.fitted.record.body.axis_along_gravity(0), motions)
    tilts = {each.row: each.effect for each in model.torques if each.tilts_gravity}
    model = replace(model, torques=tuple(each for each in model.torques if not each.tilts_gravity))
    apart = motors_apart(model, kind)
    model = apart.rest
    geometry = model.geometry
    if tilted is not None:
        geometry, standard = replace(geometry, gravity=tilted.gravity), tilted.standard
    rigid = InverseDynamics(model.geometry, [model.standard])
    whole = module_torque(module_of(model), model)

    def friction(motion: Motion) -> Array:
        bare = replace(motion, payload=motion.payload.model_copy(update={"mass": 0.0, "inertia": (0.0,) * 6}))
        return whole(bare) - rigid.torques(motion.q, motion.dq, motion.ddq)[0]

    bodied = replace(model, standard=standard)
    parts = joint_parts(bodied, kind, motions, friction)
    robot = LinkFile(geometry, bodies_of(standard), tuple(part.friction for part in parts), apart.motors)
    remarks = shared_motor_remarks(model)
    described = []
    for joint, part in enumerate(parts):
        exact = [name for name in part.kept if name != RIGID or kept]
        near = [*part.approximated, *([] if kept else [RIGID])]
        near += sorted(effect for effect, row in apart.near if row == joint and effect not in near)
        exact += sorted(effect for effect, row in apart.kept if row == joint and effect not in near)
        sorts = (exact, near, [*part.lost])
        if tilted is not None and joint in tilts:
            sorts[tilted.sort(joint)].append(tilts[joint])
        described.append(sorts)
    if not kept:
        remarks.append(
            "the identified base parameters belong to no bodies with mass"
            + ("" if kind in HAS_ROTORS else " and without rotors, which the format does not have")
            + "; the nearest that do were taken"
        )
    if kind == "urdf":
        gravity = " ".join(repr(float(value)) for value in geometry.gravity)
        remarks.append(
            f"a URDF does not say which way gravity points: set it to {gravity} m/s² in the base frame"
        )
    if kind == "sdf":
        remarks += joints_renamed(geometry.names)
    if tilted is not None:
        remarks += tilted.in_words(model.geometry.names)
    if any(friction.is_polynomial for friction in robot.friction):
        remarks.append(
            "damping is a polynomial of the speed; versions of MuJoCo before that had one number refuse it"
        )
    if any(friction.constant for friction in robot.friction):
        remarks.append(
            "a constant torque is the bias of the joint's actuator, whose control is the torque that the motor must give; a force"
            " that is applied in another way stands beside it"
        )
    if kind == "xml":
        remarks.append(
            "frictionloss is a soft constraint of MuJoCo: a joint that dry friction should hold at rest creeps"
        )
    text = WRITERS[kind](robot, c_name(target.stem))

    return _Export({target.name: text}, described, tuple(remarks), geometry.gravity)


def motions_of(result: Identification) -> list[Motion]:
    """The motion of the identification sessions, decimated rows."""
    record = result.fitted.record
    motions = []
    for entry in result.fitted.entries:
        for context in contexts(record, entry, None):
            block = context.block
            q, dq, ddq = (block.at_decimated(values) for values in (block.q, block.dq, block.ddq))
            temperature = None if block.temperature is None else block.at_decimated(block.temperature)
            time = block.decimated_time - context.session_start
            motions.append(Motion(time, q, dq, ddq, temperature, entry.payload))
    return motions
