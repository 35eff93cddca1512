"""An exported Python module, run by an interpreter of its own that has nothing but the module and NumPy."""

from __future__ import annotations

import io
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.payload import payload_parameters
from identify.export.record_error import Motion, TorqueOf
from identify.recording import InputError

Array = NDArray[np.float64]

SIZE = 8
"""bytes of the number of bytes that stands before a message; a message is arrays one behind the other, each as NumPy saves it"""
ANSWERS = """
import importlib.util, io, sys
import numpy as np
given, answers = sys.stdin.buffer, sys.stdout.buffer
sys.stdout = sys.stderr
spec = importlib.util.spec_from_file_location("exported", sys.argv[1])
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
while size := given.read(8):
    message = io.BytesIO(given.read(int.from_bytes(size, "little")))
    q, dq, ddq, t, warm, payload = (np.load(message) for _ in range(6))
    memory = None
    if module.MEMORIES:
        states = [module.memory_at_start(dq[0])]
        for before, after in zip(q[:-1], q[1:]):
            states.append(module.memory_after(states[-1], before, after))
        memory = [np.array(state) for state in zip(*states)]
    warm = warm.T if warm.size else None
    if hasattr(module, "torque_along"):
        torque = module.torque_along(q.T, dq.T, ddq.T, t, t, warm, memory, payload)
    else:
        torque = module.torque(q.T, dq.T, ddq.T, t, warm, memory, payload)
    message = io.BytesIO()
    np.save(message, torque.T)
    answers.write(len(message.getvalue()).to_bytes(8, "little") + message.getvalue())
    answers.flush()
"""
"""what that interpreter does: torques of the motions that come in"""


@contextmanager
def python_torque(path: Path) -> Iterator[TorqueOf]:
    """What a module returns, its memories carried from row to row.

    Raises InputError: Python does not take the module.
    """
    waits = re.search(r"^LATENCY = (\d+)$", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    latency = int(waits[1]) if waits else 0
    with (
        tempfile.TemporaryFile() as said,
        subprocess.Popen(
            [sys.executable, "-I", "-c", ANSWERS, str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=said,
        ) as process,
    ):
        given, answers = process.stdin, process.stdout
        assert given is not None
        assert answers is not None

        def torque_of(given_motion: Motion) -> Array:
            motion = given_motion.continued(latency)
            warm = np.empty(0) if motion.temperature is None else motion.temperature
            asked = (motion.q, motion.dq, motion.ddq, motion.t, warm, payload_parameters(motion.payload))
            message = io.BytesIO()
            for values in asked:
                np.save(message, np.asarray(values, float))
            try:
                given.write(len(message.getvalue()).to_bytes(SIZE, "little") + message.getvalue())
                given.flush()
                size = answers.read(SIZE)
                torque = np.load(io.BytesIO(answers.read(int.from_bytes(size, "little"))))
                return torque[: len(given_motion.q)]
            except (OSError, ValueError, EOFError):
                process.kill()
                process.wait()
                said.seek(0)
                last = said.read().decode(errors="replace").strip().splitlines()[-1:]
                raise InputError(f"{path.name}: Python does not take it: {''.join(last)}") from None

        try:
            yield torque_of
        finally:
            with suppress(OSError):  # it ended before
                given.close()
