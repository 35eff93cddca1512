"""A minute of six joints at 1 kHz, simulated in a hundred windows, beside MuJoCo with the exported MJCF.

    python benchmarks/simulation_rollout.py [--seconds 60] [--windows 100] [--json]

An arm with viscous and dry friction moves on sinusoids of incommensurable periods; its record (torque with noise) is
identified, and each window begins at a measured state and is driven by the recorded torque. MuJoCo steps the model that
`coulomb export` wrote from the same states with the same torque at the record's rate, on one core, window after window.
Both errors are against the measured positions. Wanted: under 20 s on two cores for our part.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

import mujoco
import numpy as np
import yaml

from identify import load_experiment
from identify.dynamics.geometry import Geometry
from identify.dynamics.inverse_dynamics import InverseDynamics
from identify.export.write import write_export
from identify.identification import identify
from identify.simulation.measured_motion import measured_motions
from identify.simulation.rollout import roll_out
from identify.simulation.torque_model import TorqueModel

RATE = 1000.0
# alpha, d, theta, r of an arm with a spherical wrist
FRAMES = [
    (0.0, 0.0, 0.0, 0.0),
    (-np.pi / 2, 0.0, -np.pi / 2, 0.0),
    (0.0, 0.225, np.pi / 2, 0.035),
    (np.pi / 2, 0.0, 0.0, 0.225),
    (-np.pi / 2, 0.0, 0.0, 0.0),
    (np.pi / 2, 0.0, 0.0, 0.0),
]
MASS = np.array([8.0, 6.0, 4.0, 2.5, 1.5, 0.5])
SIZE = np.array([0.15, 0.2, 0.12, 0.1, 0.06, 0.04])
ROTOR = np.array([0.9, 0.9, 0.4, 0.15, 0.12, 0.1])
VISCOUS = np.array([6.0, 5.0, 3.0, 1.2, 1.0, 0.8])
DRY = np.array([5.0, 6.0, 4.0, 2.0, 1.5, 1.0])
GAIN = 10.0


def bodies() -> np.ndarray:
    """(66,) standard parameters: balls off their joints' axes."""
    links = []
    for mass, size, rotor in zip(MASS, SIZE, ROTOR, strict=True):
        centre = size * np.array([0.6, -0.3, 0.4])
        inertia = 0.4 * mass * size**2 * np.eye(3) + mass * (
            centre @ centre * np.eye(3) - np.outer(centre, centre)
        )
        moments = inertia[[0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]
        links.append(np.concatenate([moments, mass * centre, [mass, rotor]]))
    return np.concatenate(links)


def write_record(folder: Path, seconds: float, seed: int = 1) -> None:
    """The experiment: one session, positions with the encoder's steps, commands with noise."""
    random = np.random.default_rng(seed)
    joints = [
        {"name": f"j{k + 1}", "type": "revolute", "alpha": a, "d": d, "theta": t, "r": r, "drive_gain": GAIN}
        for k, (a, d, t, r) in enumerate(FRAMES)
    ]
    content = {
        "format": 1,
        "name": "six joints",
        "robot": {"gravity": [0.0, 0.0, -9.81], "joints": joints},
        "payloads": [{"name": "none", "mass": 0.0}],
        "sessions": [{"file": "session-00.csv", "payload": "none"}],
    }
    (folder / "experiment.yaml").write_text(yaml.safe_dump(content))
    time_ = np.arange(int(seconds * RATE)) / RATE
    amplitude = np.array([1.0, 0.6, 0.7, 1.0, 0.8, 1.2])
    speeds = 2 * np.pi * np.array([0.11, 0.13, 0.17, 0.19, 0.23, 0.29])
    phases = random.uniform(0, 2 * np.pi, (2, 6))
    q, dq, ddq = np.zeros((3, len(time_), 6))
    for factor, share, phase in ((1.0, 0.7, phases[0]), (np.sqrt(7.0), 0.3, phases[1])):
        w = factor * speeds
        angle = time_[:, None] * w + phase
        q += share * amplitude * np.sin(angle)
        dq += share * amplitude * w * np.cos(angle)
        ddq -= share * amplitude * w**2 * np.sin(angle)
    geometry = Geometry.from_robot(load_experiment_robot(folder))
    (torque,) = InverseDynamics(geometry, [bodies()]).torques(q, dq, ddq)
    torque = torque + VISCOUS * dq + DRY * np.sign(dq)
    command = torque / GAIN + 0.01 * random.standard_normal(q.shape)
    counts = 2 * np.pi / 800_000
    names = ["t", *(f"q{k + 1}" for k in range(6)), *(f"v{k + 1}" for k in range(6))]
    np.savetxt(
        folder / "session-00.csv",
        np.column_stack([time_, np.round(q / counts) * counts, command]),
        delimiter=",",
        header=",".join(names),
        comments="",
        fmt="%.9g",
    )


def load_experiment_robot(folder: Path):
    """The robot that the experiment declares."""
    (folder / "session-00.csv").touch()
    return load_experiment(folder).robot


def in_mujoco(file: Path, motion, starts: list[int], samples: int) -> tuple[float, float, np.ndarray]:
    """Seconds on the wall and of the processor, and error (rad, by joint) of the same windows stepped by MuJoCo."""
    model = mujoco.MjModel.from_xml_path(str(file))
    model.opt.timestep = 1.0 / RATE
    stride = round(motion.period * RATE)
    torque = np.column_stack(
        [
            np.interp(
                np.arange(len(motion) * stride) / stride, np.arange(len(motion)), motion.torque[:, joint]
            )
            for joint in range(6)
        ]
    )
    begun, used = time.perf_counter(), time.process_time()
    squares = np.zeros(6)
    for start in starts:
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = motion.q[start], motion.dq[start]
        for sample in range(samples - 1):
            for part in range(stride):
                data.ctrl[:] = torque[(start + sample) * stride + part]
                mujoco.mj_step(model, data)
            squares += (data.qpos - motion.q[start + sample + 1]) ** 2
    wall, cpu = time.perf_counter() - begun, time.process_time() - used
    return wall, cpu, np.sqrt(squares / (len(starts) * (samples - 1)))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--windows", type=int, default=100)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_record(folder, asked.seconds)
        result = identify(load_experiment(folder), "usual")
        entry = result.fitted.entries[0]
        (motion,) = measured_motions(result.fitted.record, entry)
        samples = len(motion) // asked.windows
        starts = [window * samples for window in range(asked.windows)]
        begun, used = time.perf_counter(), time.process_time()
        course = roll_out(TorqueModel(result.fitted, entry), motion, starts, samples)
        ours, cpu = time.perf_counter() - begun, time.process_time() - used
        rows = course.starts[None, :] + np.arange(samples)[:, None]
        error = np.sqrt(np.mean((course.q - motion.q[rows]) ** 2, axis=(0, 1)))
        certificate = write_export(result, folder / "arm.xml")
        theirs, mujoco_cpu, mujoco_error = in_mujoco(folder / "arm.xml", motion, starts, samples)
    found = {
        "seconds": asked.seconds,
        "windows": asked.windows,
        "horizon": samples * motion.period,
        "step": motion.period,
        "wall": ours,
        "cpu": cpu,
        "position_rms": error.tolist(),
        "mujoco_wall": theirs,
        "mujoco_cpu": mujoco_cpu,
        "mujoco_position_rms": mujoco_error.tolist(),
        "certificate": [[own.relative_error_model, own.relative_error_export] for own in certificate.joints],
    }
    if asked.json:
        print(json.dumps(found))
        return
    print(f"{asked.windows} windows of {found['horizon']:.2f} s, {1e3 * motion.period:g} ms a step")
    print(
        f"coulomb   {ours:6.2f} s wall, {cpu:6.2f} s of processor; rms {np.array2string(error, precision=5)} rad"
    )
    print(
        f"MuJoCo    {theirs:6.2f} s wall, {mujoco_cpu:6.2f} s of processor; rms {np.array2string(mujoco_error, precision=5)} rad"
    )


if __name__ == "__main__":
    main()
