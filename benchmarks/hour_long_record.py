"""`coulomb identify` on an hour of a six-joint robot at 1 kHz: 3.6 million samples, within a gigabyte.

    python benchmarks/hour_long_record.py [--samples 3600000] [--format hdf5|csv|csv.gz] [--keep FOLDER]

Generates the record (a sum of sinusoids on every joint, torques by the recursion of the regressor with random but
feasible inertias, friction, noise, positions rounded to an encoder's step) block by block in a process of its own, then
runs `coulomb identify` from the files to JSON and prints wall time, CPU time and peak memory as the kernel counts
them, beside the size of the record itself. Memory is what is looked at: it must not grow with the samples.
"""

from __future__ import annotations

import argparse
import gzip
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).resolve().parent.parent
JOINTS = 6
RATE = 1000.0
BLOCK = 50_000
STEP = 2 * np.pi / (4096 * 100)
"""rad, an encoder of 4096 steps behind a gear of 100"""

ROBOT = {
    "gravity": [0.0, 0.0, -9.81],
    "joints": [
        {"name": f"j{index + 1}", "type": "revolute", "alpha": alpha, "d": d, "r": r, "drive_gain": 10.0}
        for index, (alpha, d, r) in enumerate(
            [
                (0.0, 0.0, 0.3),
                (-np.pi / 2, 0.1, 0.0),
                (0.0, 0.5, 0.0),
                (-np.pi / 2, 0.05, 0.5),
                (np.pi / 2, 0.0, 0.0),
                (-np.pi / 2, 0.0, 0.1),
            ]
        )
    ],
}


def motion(time_: np.ndarray, joint: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q, dq, ddq of one joint: three sinusoids whose frequencies no two joints share."""
    frequency = 2 * np.pi * np.array([0.07, 0.19, 0.43]) * (1 + 0.13 * joint)
    amplitude = np.array([0.8, 0.3, 0.15])
    angle = frequency * time_[:, None] + joint + np.array([0.3, 1.1, 2.7])
    return (
        np.sin(angle) @ amplitude,
        np.cos(angle) @ (amplitude * frequency),
        -np.sin(angle) @ (amplitude * frequency**2),
    )


def generate(folder: Path, samples: int, kind: str) -> None:
    """Write the experiment, block by block."""
    import yaml

    from identify.dynamics.geometry import Geometry
    from identify.dynamics.regressor import standard_regressor
    from identify.recording.experiment_file import ExperimentFile

    file = f"session-00.{'h5' if kind == 'hdf5' else kind}"
    document = {
        "format": 1,
        "name": "an hour",
        "robot": ROBOT,
        "payloads": [{"name": "none", "mass": 0.0}],
        "sessions": [{"file": file, "payload": "none"}],
    }
    (folder / "experiment.yaml").write_text(yaml.safe_dump(document))
    plain = json.loads(json.dumps(document))
    plain["robot"]["joints"] = tuple(plain["robot"]["joints"])
    plain["robot"]["gravity"] = tuple(plain["robot"]["gravity"])
    plain["payloads"], plain["sessions"] = tuple(plain["payloads"]), tuple(plain["sessions"])
    geometry = Geometry.from_robot(ExperimentFile.model_validate(plain).robot)
    random = np.random.default_rng(7)
    standard = np.concatenate([link(random) for _ in range(JOINTS)])
    writer = Hdf5(folder / file) if kind == "hdf5" else Csv(folder / file)
    for begin in range(0, samples, BLOCK):
        index = np.arange(begin, min(begin + BLOCK, samples))
        course = [motion(index / RATE, joint) for joint in range(JOINTS)]
        q, dq, ddq = (np.column_stack([own[part] for own in course]) for part in range(3))
        torque = np.concatenate(
            [
                standard_regressor(geometry, q[part], dq[part], ddq[part]) @ standard
                for part in np.array_split(np.arange(len(index)), 10)
            ]
        )
        torque += 4.0 * np.sign(dq) + 3.0 * dq + 0.5 * random.standard_normal(dq.shape)
        writer.write(index, np.round(q / STEP).astype(np.int64), torque / 10.0)
    writer.close()


def link(random: np.random.Generator) -> np.ndarray:
    """XX … M, Ia of a cloud of point masses."""
    masses, points = random.uniform(0.1, 1.0, 10), random.normal(0.05, 0.1, (10, 3))
    second = (masses[:, None] * points).T @ points
    inertia = np.trace(second) * np.eye(3) - second
    return np.concatenate([inertia[np.triu_indices(3)], masses @ points, [masses.sum(), 0.3]])


class Csv:
    """A session as CSV, plain or gzip."""

    def __init__(self, path: Path) -> None:
        packed = path.suffix == ".gz"
        self.stream = gzip.open(path, "wt", compresslevel=1) if packed else path.open("w")  # noqa: SIM115
        names = [f"{kind}{joint + 1}" for kind in "qv" for joint in range(JOINTS)]
        self.stream.write(",".join(["t", *names]) + "\n")

    def write(self, index: np.ndarray, counts: np.ndarray, command: np.ndarray) -> None:
        table = np.column_stack([index / RATE, counts * STEP, command])
        np.savetxt(self.stream, table, fmt="%.9g", delimiter=",")

    def close(self) -> None:
        self.stream.close()


class Hdf5:
    """A session as the product's own recording: raw counts and their scaling."""

    SCALE = 1e-3

    def __init__(self, path: Path) -> None:
        import h5py

        self.file = h5py.File(path, "w", libver="latest")
        attributes = {
            "format": 1, "software_version": "0", "rig": "{}", "plan": "{}", "payload": "{}", "counters": "{}",
            "operator": "", "host": "", "started": "2026-01-01T00:00:00+00:00", "clock_source": "generated",
            "cycle": 1 / RATE, "status": "complete", "status_reason": "",
        }  # fmt: skip
        self.file.attrs.update(attributes)
        shapes = {
            "cycle": ((), "i8"), "sync_time": ((), "i8"), "position": ((JOINTS,), "i4"),
            "command": ((JOINTS,), "i4"), "setpoint": ((JOINTS,), "i4"), "valid": ((JOINTS,), "u1"),
        }  # fmt: skip
        self.data = {
            name: self.file.create_dataset(
                name, (0, *shape), dtype, maxshape=(None, *shape), chunks=(4096, *shape)
            )
            for name, (shape, dtype) in shapes.items()
        }
        self.data["position"].attrs["matrix"] = STEP * np.eye(JOINTS)
        self.data["position"].attrs["offset"] = np.zeros(JOINTS)
        self.data["command"].attrs["scale"] = np.full(JOINTS, self.SCALE)

    def write(self, index: np.ndarray, counts: np.ndarray, command: np.ndarray) -> None:
        rows = {
            "cycle": index,
            "sync_time": (index * 1e9 / RATE).astype(np.int64),
            "position": counts,
            "command": np.round(command / self.SCALE),
            "setpoint": counts,
            "valid": np.full(counts.shape, 3),
        }
        for name, values in rows.items():
            data = self.data[name]
            data.resize(len(data) + len(values), axis=0)
            data[-len(values) :] = values

    def close(self) -> None:
        self.file.close()


def measured_identify(folder: Path) -> tuple[float, float, int, dict]:
    """Wall s, CPU s, peak bytes and the document of `coulomb identify --json`."""
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    with tempfile.TemporaryFile("w+") as output:
        started = time.perf_counter()
        process = subprocess.Popen(
            [sys.executable, "-m", "api", "identify", str(folder), "--json"], stdout=output, env=environment
        )
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - started
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        if process.returncode:
            raise SystemExit(f"coulomb identify ended with status {process.returncode}")
        return wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024, json.loads(output.read())


def main() -> None:
    """Generate, identify, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--samples", type=int, default=3_600_000)
    parser.add_argument("--format", choices=("hdf5", "csv", "csv.gz"), default="hdf5")
    parser.add_argument("--keep", type=Path, help="folder to generate into; used again if it has the record")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.keep or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / "experiment.yaml").exists():
            generate(folder, options.samples, options.format)
        size = sum(path.stat().st_size for path in folder.iterdir())
        wall, cpu, peak, document = measured_identify(folder)
    raw = options.samples * (2 * JOINTS + 1) * 8
    print(f"samples                {options.samples:>10,} of {JOINTS} joints")
    print(f"record on disk         {size / 1e6:>10.0f} MB")
    print(f"record as float64      {raw / 1e6:>10.0f} MB")
    print(f"decimated rows used    {document['samples']:>10,}")
    print(f"relative error         {100 * document['relative_error']:>10.2f} %")
    print(f"wall time              {wall:>10.1f} s")
    print(f"CPU time               {cpu:>10.1f} s")
    print(f"peak memory            {peak / 1e6:>10.0f} MB   {peak / raw:.2f} of the record as float64")


if __name__ == "__main__":
    sys.path.insert(0, str(REPOSITORY))
    main()
