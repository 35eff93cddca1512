"""`coulomb diagnose` on one, two and more workers, and the memory of each as the record grows.

    python benchmarks/scale.py [--sessions 4] [--minutes 1 4] [--workers 1 2] [--command identify]

Records of a joint (`tests/plants`), of sessions of the stated length at 1 kHz, are identified or diagnosed by each
number of workers. Printed are wall time, CPU time of the process that asks and of its workers, and the highest resident
memory of that process and of the largest worker, as the kernel counts them. What the asking process computes itself is the
part that no worker takes away.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(REPOSITORY))

PROGRAM = """
import json, resource, sys, time
import identify
from api.computing import Computing

folder, workers, command = sys.argv[1], int(sys.argv[2]), sys.argv[3]
began = time.perf_counter()
with Computing(workers)():
    result = getattr(identify, command)(identify.load_experiment(folder)).to_json()
wall = time.perf_counter() - began
own, others = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
print(json.dumps({
    "wall": wall,
    "cpu": own.ru_utime + own.ru_stime,
    "worker_cpu": others.ru_utime + others.ru_stime,
    "memory": own.ru_maxrss / 1024,
    "worker_memory": others.ru_maxrss / 1024,
    "error": result["relative_error"],
}))
"""


def main() -> None:
    """Write the records, run each, print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sessions", type=int, default=4)
    parser.add_argument("--minutes", type=float, nargs="+", default=[1.0, 4.0], help="of each session")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--command", choices=("identify", "diagnose"), default="diagnose")
    options = parser.parse_args()
    from process_cost import measure

    from tests.plants.single_joint import record, write_experiment

    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    print(
        f"{'samples':>10} {'workers':>8} {'wall s':>8} {'CPU here':>9} {'workers':>8} {'MB here':>8} {'MB worker':>10}"
    )
    with tempfile.TemporaryDirectory() as scratch:
        for minutes in options.minutes:
            recorded = record(
                {"stribeck": 1.0},
                seed=1,
                duration=60.0 * minutes,
                rate=1000.0,
                payload_masses=[float(index) for index in range(options.sessions)],
            )
            folder = write_experiment(Path(scratch) / f"{minutes:g}", recorded)
            samples = sum(len(session["t"]) for session in recorded.sessions)
            for workers in options.workers:
                cost = measure([sys.executable, "-c", PROGRAM, str(folder), str(workers), options.command])
                found = cost.answer
                print(
                    f"{samples:>10,} {workers:>8} {found['wall']:>8.1f} {found['cpu']:>9.1f} {found['worker_cpu']:>8.1f}"
                    f" {found['memory']:>8.0f} {found['worker_memory'] if workers > 1 else 0:>10.0f}"
                    f"   error {found['error']:.9f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
