"""An exported C source, compiled and called."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.payload import payload_parameters
from identify.export.record_error import Motion, TorqueOf
from identify.recording import InputError

Array = NDArray[np.float64]
_Doubles = ctypes.POINTER(ctypes.c_double)


def compiler_here() -> str | None:
    """The C compiler of this computer."""
    return shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


def compile_library(compiler: str, sources: Sequence[Path], library: Path, *options: str) -> None:
    """Compile C sources into a shared library.

    options : of the compiler, beside those that every library is made with
    Raises InputError: the compiler refuses a source.
    """
    files = [str(source) for source in sources]
    command = [compiler, "-std=c99", "-O2", "-fPIC", "-shared", *options, "-o", str(library), *files, "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise InputError(
            f"{sources[0].name}: {compiler} could not compile it: {done.stderr.strip().splitlines()[:1]}"
        )


def compiled_torque(compiler: str, source: Path) -> TorqueOf:
    """What the functions of an exported C source return, row by row, their memories carried on.

    Prefix of the functions and number of memories are those of the header beside the source.
    Raises InputError: the compiler refuses the source, or the header does not say what it must.
    """
    header = source.with_suffix(".h").read_text(encoding="utf-8")
    named = re.search(r"void (\w+)_rigid_torque\(const double q\[", header)
    counted = re.search(r"#define \w+_MEMORIES (\d+)", header)
    if named is None or counted is None:
        raise InputError(f"{source.stem}.h: it does not declare what an exported model has")
    prefix = named[1]
    waits = re.search(r"#define \w+_LATENCY (\d+)", header)
    latency = int(waits[1]) if waits else 0
    library = source.with_suffix(".so")
    compile_library(compiler, [source], library)
    loaded = ctypes.CDLL(str(library))
    if latency:
        return _stepped_torque(loaded, prefix, latency)
    torque = getattr(loaded, f"{prefix}_torque")
    torque.argtypes = [_Doubles, _Doubles, _Doubles, ctypes.c_double, _Doubles, _Doubles, _Doubles, _Doubles]
    torque.restype = None
    start, after = getattr(loaded, f"{prefix}_memory_at_start"), getattr(loaded, f"{prefix}_memory_after")
    start.argtypes, after.argtypes = [_Doubles, _Doubles], [_Doubles, _Doubles, _Doubles]
    start.restype = after.restype = None

    def torque_of(motion: Motion) -> Array:
        q, dq, ddq = (np.ascontiguousarray(part, float) for part in (motion.q, motion.dq, motion.ddq))
        warm = None if motion.temperature is None else np.ascontiguousarray(motion.temperature, float)
        memory = np.zeros(max(1, int(counted[1])))
        payload = np.ascontiguousarray(payload_parameters(motion.payload))
        out = np.zeros(q.shape)
        for row in range(len(q)):
            if row == 0:
                start(_at(dq[0]), _at(memory))
            else:
                after(_at(memory), _at(q[row - 1]), _at(q[row]))
            degrees = None if warm is None else _at(warm[row])
            t = float(motion.t[row])
            torque(
                _at(q[row]), _at(dq[row]), _at(ddq[row]), t, degrees, _at(memory), _at(payload), _at(out[row])
            )
        return out

    return torque_of


def _stepped_torque(loaded: ctypes.CDLL, prefix: str, latency: int) -> TorqueOf:
    """What the steps of a source with a latency return, set beside the motion that they are of."""
    begin, step, size = (getattr(loaded, f"{prefix}_{name}") for name in ("begin", "step", "size"))
    begin.argtypes, begin.restype = [ctypes.c_void_p], None
    number = ctypes.c_double
    step.argtypes = [ctypes.c_void_p, *[_Doubles] * 3, number, number, *[_Doubles] * 3]
    step.restype = None
    size.argtypes, size.restype = [], ctypes.c_size_t

    def torque_of(asked: Motion) -> Array:
        motion = asked.continued(latency)
        q, dq, ddq = (np.ascontiguousarray(part, float) for part in (motion.q, motion.dq, motion.ddq))
        warm = None if motion.temperature is None else np.ascontiguousarray(motion.temperature, float)
        payload = np.ascontiguousarray(payload_parameters(motion.payload))
        out = np.zeros(q.shape)
        cycles = ctypes.create_string_buffer(size())
        begin(cycles)
        for row, period in enumerate(np.diff(motion.t, prepend=motion.t[0]).tolist()):
            degrees = None if warm is None else _at(warm[row])
            t = float(motion.t[row])
            now = (_at(q[row]), _at(dq[row]), _at(ddq[row]))
            step(cycles, *now, period, t, degrees, _at(payload), _at(out[row]))
        return out[latency:]

    return torque_of


def _at(values: Array):
    return values.ctypes.data_as(_Doubles)
