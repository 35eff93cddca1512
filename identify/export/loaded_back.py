"""Exported files loaded back, each by what it is for, so that a certificate speaks of the file and of nothing else."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.geometry import Geometry
from identify.dynamics.payload import payload_torque
from identify.export.compiled import compiled_torque, compiler_here
from identify.export.document_torque import document_torque
from identify.export.fmu import platform_name
from identify.export.fmu_torque import fmu_torque, has_fmpy
from identify.export.link_file_torque import ProgramRefuses, arm_torque
from identify.export.python_process import python_torque
from identify.export.record_error import Motion, TorqueOf
from identify.export.structured_text_torque import structured_text_torque
from identify.recording import InputError

Array = NDArray[np.float64]

NO_COMPILER = "there is no C compiler on this computer (cc, gcc or clang); install one and export again to have it measured"
NO_FMPY = "FMPy is not installed; install the extra `fmu` and export again to have it measured"


class NotMeasured(Exception):
    """Why a file's torques could not be computed on this computer, and what would make it so; the file itself may be right."""


@dataclass(frozen=True)
class LoadedBack:
    """Torques of a file, and what read and computed them."""

    torque_of: TorqueOf
    by: str


@contextmanager
def loaded_back(path: Path, geometry: Geometry) -> Iterator[LoadedBack]:
    """A written file's torques. What is made on the way is left beside it.

    geometry : the robot's frames, for the torque of a payload, which files with bodies do not hold, and for gravity, which a
        URDF does not state
    Raises NotMeasured: a program that it takes is not here, or refuses the file. InputError: the file is not what it must be.
    """
    if path.suffix == ".py":
        with python_torque(path) as torque_of:
            yield LoadedBack(torque_of, "the module, run by a Python interpreter of its own")
        return
    yield _loaded(path, geometry)


def _loaded(path: Path, geometry: Geometry) -> LoadedBack:
    match path.suffix:
        case ".st":
            by = "the text, read and run by coulomb's own reader of IEC 61131-3"
            return LoadedBack(structured_text_torque(path), by)
        case ".json":
            return LoadedBack(document_torque(path), "the file, read back and evaluated")
        case ".c":
            return _compiled(path)
        case ".fmu":
            return _stepped(path)
        case _:
            return _opened(path, geometry)


def _compiled(path: Path) -> LoadedBack:
    compiler = compiler_here()
    if compiler is None:
        raise NotMeasured(NO_COMPILER)
    try:
        torque_of = compiled_torque(compiler, path)
    except InputError as refusal:
        raise NotMeasured(str(refusal)) from None
    return LoadedBack(torque_of, "the source, compiled and run")


def _stepped(path: Path) -> LoadedBack:
    with zipfile.ZipFile(path) as unit:
        if not any(name.startswith(f"binaries/{platform_name()}/") for name in unit.namelist()):
            raise NotMeasured(f"the unit has sources and no binary for {platform_name()}: {NO_COMPILER}")
    if not has_fmpy():
        raise NotMeasured(NO_FMPY)
    try:
        torque_of = fmu_torque(path)
    except InputError as refusal:
        raise NotMeasured(str(refusal)) from None
    return LoadedBack(_or_not_measured(torque_of), "the unit, stepped by FMPy")


def _or_not_measured(torque_of: TorqueOf) -> TorqueOf:
    """Torques of a program that may refuse while it runs."""

    def asked(motion: Motion) -> Array:
        try:
            return torque_of(motion)
        except InputError as refusal:
            raise NotMeasured(str(refusal)) from None

    return asked


def _opened(path: Path, geometry: Geometry) -> LoadedBack:
    try:
        arm, by = arm_torque(path, geometry.gravity)
    except ProgramRefuses as refusal:
        raise NotMeasured(str(refusal)) from None

    def torque_of(motion: Motion) -> Array:
        q, dq, ddq = motion.q, motion.dq, motion.ddq
        return arm(q, dq, ddq) + payload_torque(geometry, motion.payload, q, dq, ddq)

    return LoadedBack(torque_of, by)
