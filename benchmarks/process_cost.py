"""What a command costs as a whole process: for benchmarks that set processes side by side."""

import json
import os
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

REPOSITORY = Path(__file__).parents[1]


@dataclass(frozen=True)
class Cost:
    """What one process cost: s, s, bytes; and the last line it printed."""

    wall: float
    cpu: float
    peak_memory: int
    answer: dict


def measure(command: list[str], checkout: Path = REPOSITORY) -> Cost:
    """Run a command of a checkout to its end; stop with its words if it fails."""
    beside = os.environ.get("PYTHONPATH")  # what else is to be importable, as pandas beside a notebook
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(checkout), *([beside] if beside else [])]),
    }
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # or every run would compile every module anew
    with tempfile.TemporaryFile("w+") as output, tempfile.TemporaryFile("w+") as errors:
        started = time.perf_counter()
        process = subprocess.Popen(command, stdout=output, stderr=errors, env=environment, cwd=checkout)
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - started
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        errors.seek(0)
        if process.returncode != 0:
            raise SystemExit(f"{' '.join(command)} failed:\n{errors.read()}")
        answer = json.loads(output.read().strip().splitlines()[-1])
    return Cost(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024, answer)
