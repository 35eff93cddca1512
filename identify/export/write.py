"""`export`: a model into a file that somebody else's program takes, and the certificate beside it."""

from __future__ import annotations

import importlib.util
import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.inverse_dynamics import InverseDynamics
from identify.dynamics.payload import payload_parameters
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT
from identify.estimation.context import contexts
from identify.estimation.small_algebra import single_threaded
from identify.export.bodies import feasible_standard
from identify.export.c_code import c_code, c_name
from identify.export.compiled import compiled_torque, compiler_here
from identify.export.exported_model import RIGID, ExportedModel, exported_model
from identify.export.fmu import fmu, platform_name
from identify.export.fmu_torque import fmu_torque, has_fmpy
from identify.export.joint_friction import HAS_ROTORS, joint_parts
from identify.export.link_files import WRITERS, LinkFile, bodies_of, read_back
from identify.export.python_code import python_code
from identify.export.record_error import Motion, TorqueOf, errors_of_model, errors_on_record
from identify.export.structured_text import structured_text
from identify.export.structured_text_torque import structured_text_torque
from identify.identification import Identification, identify
from identify.recording import Experiment, InputError
from identify.results.certificate import Certificate, JointCertificate
from identify.results.exported_model import (
    ExportedBaseParameter,
    ExportedLink,
    ExportedModelDocument,
    ExportedTorque,
)

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


@dataclass(frozen=True)
class _Export:
    """Contents by file name, what loads them back, and what the format keeps of each joint."""

    files: dict[str, str | bytes]
    torque_of: Callable[[Path], TorqueOf]
    checked_with: str
    parts: Sequence[tuple[Sequence[str], Sequence[str], Sequence[str]]]
    remarks: tuple[str, ...] = ()


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
    """The ending of a target.

    Raises InputError: there is no such format, no folder to write to, a folder stands where a file is to be written, or
        C could not include the header.
    """
    if target.suffix not in KINDS:
        listed = ", ".join(f"{ending} ({kind})" for ending, kind in KINDS.items())
        raise InputError(f"{target}: a model is written as {listed}")
    if not target.resolve().parent.is_dir():
        raise InputError(f"{target}: there is no folder {target.resolve().parent}")
    if not os.access(target.resolve().parent, os.W_OK):
        raise InputError(f"{target}: the folder {target.resolve().parent} cannot be written to")
    if target.suffix == ".c" and (not target.stem.isprintable() or set(target.stem) & set('"\\')):
        raise InputError(f"{target}: C cannot include a header of this name; use letters, digits and '_'")
    beside = [_certificate_of(target)]
    if target.suffix == ".c":
        beside.append(target.with_suffix(".h"))
    try:
        folders = [written for written in (target, *beside) if written.is_dir()]
    except OSError as problem:
        raise InputError(f"{target}: cannot be written: {problem.strerror}") from problem
    if folders:
        raise InputError(f"{folders[0]}: is a folder, but a file of this name is to be written")
    return target.suffix


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
    """Write an identified model to `target` and its certificate beside it; both or, on an error, neither."""
    ending = checked_target(target)
    model = exported_model(result)
    if ending.removeprefix(".") in WRITERS:
        made = _link_file(result, model, target, ending.removeprefix("."))
    else:
        made = _code(model, target, ending)
    try:
        workspace = tempfile.TemporaryDirectory(dir=target.resolve().parent, prefix=".coulomb-export-")
    except OSError as problem:
        raise InputError(f"{target}: cannot be written: {problem.strerror}") from problem
    with workspace as folder:
        for name, content in made.files.items():
            (Path(folder) / name).write_bytes(content.encode() if isinstance(content, str) else content)
        errors = errors_on_record(result, made.torque_of(Path(folder)))
        certificate = _certificate(result, model, target, made, errors)
        name = _certificate_of(target).name
        (Path(folder) / name).write_text(certificate.json_text(indent=1) + "\n", encoding="utf-8")
        for written in (*made.files, name):
            (Path(folder) / written).replace(target.resolve().parent / written)
    return certificate


def _certificate(
    result: Identification, model: ExportedModel, target: Path, made: _Export, errors: Sequence[float | None]
) -> Certificate:
    listed = zip(model.geometry.names, made.parts, errors_of_model(result), errors, strict=True)
    return Certificate(
        target=target.name,
        kind=KINDS[target.suffix],
        experiment=model.experiment,
        model=model.name,
        joints=tuple(
            JointCertificate(
                joint=joint,
                kept=tuple(kept),
                approximated=tuple(approximated),
                lost=tuple(lost),
                relative_error_model=before,
                relative_error_export=after,
            )
            for joint, (kept, approximated, lost), before, after in listed
        ),
        checked_with=made.checked_with,
        remarks=(*model.remarks, *made.remarks),
    )


def _code(model: ExportedModel, target: Path, ending: str) -> _Export:
    """Formats that hold every formula."""
    module, compiler = python_code(model), compiler_here()
    parts = []
    for joint in range(model.joints):
        kept = dict.fromkeys([RIGID, *(torque.effect for torque in model.torques if torque.row == joint)])
        lost = [effect for effect, place in model.lost if place == joint]
        parts.append((list(kept), [], lost))

    def in_python(folder: Path) -> TorqueOf:
        path = folder / (target.name if ending == ".py" else "formulas.py")
        path.write_text(module, encoding="utf-8")
        return module_torque(_loaded(path), model)

    if ending == ".py":
        return _Export({target.name: module}, in_python, "the module itself, loaded back", parts)
    if ending == ".c":
        source, header = c_code(model, target.stem)
        files = {target.name: source, f"{target.stem}.h": header}
        if compiler is not None:
            return _Export(
                {**files},
                lambda folder: compiled_torque(compiler, folder / target.name, c_name(target.stem), model),
                "the source, compiled and run",
                parts,
            )
        remark = "there was no C compiler: the same formulas were computed in Python"
        return _Export({**files}, in_python, "the same formulas in Python", parts, (remark,))
    if ending == ".fmu":
        return _unit(model, target, compiler, in_python, parts)
    if ending == ".st":
        return _Export(
            {target.name: structured_text(model, target.stem)},
            lambda folder: structured_text_torque(folder / target.name),
            "the text, read and run by coulomb's own reader of IEC 61131-3",
            parts,
        )
    text = _document(model).json_text(indent=1) + "\n"
    return _Export({target.name: text}, in_python, "the same formulas in Python", parts)


def _unit(
    model: ExportedModel,
    target: Path,
    compiler: str | None,
    in_python: Callable[[Path], TorqueOf],
    parts: Sequence[tuple[Sequence[str], Sequence[str], Sequence[str]]],
) -> _Export:
    """A functional mock-up unit, checked by FMPy where that is installed."""
    files: dict[str, str | bytes] = {target.name: fmu(model, target.stem, compiler)}
    if compiler is None:
        remark = "there was no C compiler: the unit has sources and no binary; the same formulas were computed in Python"
        return _Export(files, in_python, "the same formulas in Python", parts, (remark,))
    remark = f"the unit has a binary for {platform_name()}, and sources for others"
    if has_fmpy():
        return _Export(
            files,
            lambda folder: fmu_torque(folder / target.name, model),
            "the unit, stepped by FMPy",
            parts,
            (remark,),
        )

    def compiled(folder: Path) -> TorqueOf:
        prefix = c_name(target.stem)
        source, header = c_code(model, prefix)
        (folder / f"{prefix}.c").write_text(source, encoding="utf-8")
        (folder / f"{prefix}.h").write_text(header, encoding="utf-8")
        return compiled_torque(compiler, folder / f"{prefix}.c", prefix, model)

    said = "FMPy (extra fmu) was not installed: the unit itself was not run"
    return _Export(files, compiled, "the unit's C source, compiled and run", parts, (remark, said))


def module_torque(module: ModuleType, model: ExportedModel) -> TorqueOf:
    """What an exported Python module predicts, its memories carried from row to row."""

    def torque_of(motion: Motion) -> Array:
        memory = None
        if model.memories:
            states = [module.memory_at_start(motion.dq[0])]
            for row in range(1, len(motion.q)):
                states.append(module.memory_after(states[-1], motion.q[row - 1], motion.q[row]))
            memory = [np.array([state[index] for state in states]) for index in range(len(model.memories))]
        temperature = None if motion.temperature is None else motion.temperature.T
        return module.torque(
            motion.q.T,
            motion.dq.T,
            motion.ddq.T,
            motion.t,
            temperature,
            memory,
            payload_parameters(motion.payload),
        ).T

    return torque_of


def _loaded(path: Path) -> ModuleType:
    """A module from its file."""
    spec = importlib.util.spec_from_file_location(f"exported_{path.stem}".replace("-", "_"), path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _link_file(result: Identification, model: ExportedModel, target: Path, kind: str) -> _Export:
    """Formats with bodies, whose friction is damping and dry friction."""
    standard, kept = feasible_standard(result, model, rotors=kind in HAS_ROTORS and model.base.rotors)
    rigid = InverseDynamics(model.geometry, [model.standard])
    whole = module_torque(module_of(model), model)

    def friction(motion: Motion) -> Array:
        bare = replace(motion, payload=motion.payload.model_copy(update={"mass": 0.0, "inertia": (0.0,) * 6}))
        return whole(bare) - rigid.torques(motion.q, motion.dq, motion.ddq)[0]

    bodied = replace(model, standard=standard)
    parts = joint_parts(bodied, kind, motions_of(result), friction)
    robot = LinkFile(model.geometry, bodies_of(standard), tuple(part.friction for part in parts))
    remarks: list[str] = []
    described = []
    for part in parts:
        exact = [name for name in part.kept if name != RIGID or kept]
        near = [*part.approximated, *([] if kept else [RIGID])]
        described.append((exact, near, part.lost))
    if not kept:
        remarks.append(
            "the identified base parameters belong to no bodies with mass"
            + ("" if kind in HAS_ROTORS else " and without rotors, which the format does not have")
            + "; the nearest that do were taken"
        )
    if kind == "urdf":
        gravity = " ".join(f"{value:g}" for value in model.geometry.gravity)
        remarks.append(
            f"a URDF does not say which way gravity points: set it to {gravity} m/s² in the base frame"
        )
    if any(friction.is_polynomial for friction in robot.friction):
        remarks.append(
            "damping is a polynomial of the speed; versions of MuJoCo before that had one number refuse it"
        )
    if kind == "xml":
        remarks.append(
            "frictionloss is a soft constraint of MuJoCo: a joint that dry friction should hold at rest creeps"
        )
    text = WRITERS[kind](robot, c_name(target.stem))

    def torque_of(folder: Path) -> TorqueOf:
        return link_file_torque(
            read_back(kind, (folder / target.name).read_text(encoding="utf-8"), model.geometry)
        )

    checked = (
        "the file read back; torques by recursive Newton-Euler, friction by the format's own rule at speed"
    )
    return _Export({target.name: text}, torque_of, checked, described, tuple(remarks))


def link_file_torque(robot: LinkFile) -> TorqueOf:
    """Torque of a robot as its file describes it; a payload is a body on the last link."""

    def torque_of(motion: Motion) -> Array:
        standard = robot.standard()
        standard[-PARAMETERS_PER_JOINT:-1] += payload_parameters(motion.payload)
        (torque,) = InverseDynamics(robot.geometry, [standard]).torques(motion.q, motion.dq, motion.ddq)
        joints = zip(robot.friction, motion.q.T, motion.dq.T, strict=True)
        return torque + np.array([friction.torque(q, dq) for friction, q, dq in joints]).T

    return torque_of


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


def module_of(model: ExportedModel) -> ModuleType:
    """The exported Python module, made in memory."""
    module = ModuleType("exported")
    exec(compile(python_code(model), "exported", "exec"), module.__dict__)
    return module


def _document(model: ExportedModel) -> ExportedModelDocument:
    geometry = model.geometry
    x, y, z = (float(value) for value in geometry.gravity)
    links = model.standard.reshape(model.joints, -1)
    listed = zip(model.base.names, model.base.groupings, model.chi, model.base.units, strict=True)
    return ExportedModelDocument(
        experiment=model.experiment,
        model=model.name,
        gravity=(x, y, z),
        links=tuple(
            ExportedLink(
                joint=name,
                prismatic=bool(geometry.prismatic[joint]),
                alpha=float(geometry.alpha[joint]),
                d=float(geometry.d[joint]),
                theta=float(geometry.theta[joint]),
                r=float(geometry.r[joint]),
                standard=tuple(float(value) for value in links[joint]),
            )
            for joint, name in enumerate(geometry.names)
        ),
        base=tuple(
            ExportedBaseParameter(name=name, grouping=grouping, value=float(value), unit=unit)
            for name, grouping, value, unit in listed
        ),
        motor_shares=tuple(tuple(float(value) for value in row) for row in model.shares),
        torques=tuple(
            ExportedTorque(
                effect=torque.effect,
                joint=geometry.names[torque.row],
                motor=geometry.names[torque.motor],
                formulas=torque.formulas,
                values=torque.values,
                presliding_distance=torque.distance,
            )
            for torque in model.torques
        ),
    )
