"""MuJoCo's system identification on an experiment of ours: what `peers_on_the_bench.py` runs.

    python mujoco_on_a_record.py EXPERIMENT_FOLDER

One hinge with a body is fitted by `mujoco.sysid.optimize`: its residual is the torque of `mj_inverse` on the measured motion
less the measured torque, both low-passed and decimated alike, so that no controller and no start has to be known. Beside the
usual parameters (mass moments, inertia, damping, dry friction, an offset of the torque) one effect at a time is freed that MJCF
or the toolbox's modifiers of signals can express; that of the least error on every third tenth of the sessions, which the fit
does not see, comes first. Needs mujoco[sysid], SciPy and PyYAML, nothing of ours. Prints one JSON document as its last line.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import mujoco
import numpy as np
from mujoco import sysid
from refit_per_candidate import DECIMATION_CUTOFF, FOLDS, signals
from scipy.signal import butter, filtfilt

RATE = 100.0
"""Hz at which MuJoCo is asked; the decimated band ends far below"""
HEAVY = 1000.0
"""kg of the body, so that its centre is near the axis whatever its moment"""
USUAL = {
    "inertia": (5.0, 0.1, 100.0),
    "moment x": (5.0, -100.0, 100.0),
    "moment y": (0.0, -100.0, 100.0),
    "damping": (10.0, 0.0, 200.0),
    "friction": (10.0, 0.0, 200.0),
    "offset": (0.0, -50.0, 50.0),
}
"""Start and bounds, SI units."""
EFFECTS = {
    "joint-spring": {"stiffness": (0.0, -100.0, 100.0), "reference": (0.1, -2.0, 2.0)},
    "viscous-quadratic": {"quadratic": (0.0, -100.0, 100.0)},
    "viscous-cubic": {"cubic": (0.0, -100.0, 100.0)},
    "payload-mass": {"payload": (1.0, 0.5, 2.0)},
    "payload-com": {"away x": (0.0, -0.5, 0.5), "away y": (0.0, -0.5, 0.5)},
    "gravity-tilt": {"tilt": (0.0, -0.3, 0.3)},
    "drive-gain": {"gain": (1.0, 0.5, 2.0)},
    "delay": {"delay": (0.0, -0.05, 0.05)},
}
"""What MJCF or a modifier of signals can express, with the parameters that it frees."""
NOTHING = {name: start[0] for effect in EFFECTS.values() for name, start in effect.items()}


def model() -> mujoco.MjModel:
    """A hinge about a horizontal axis and a body on it."""
    return mujoco.MjModel.from_xml_string(
        """<mujoco><option gravity="0 -9.81 0"/><worldbody><body><joint type="hinge" axis="0 0 1"
        damping="1" frictionloss="1" stiffness="1"/><inertial pos="0.1 0 0" mass="1000"
        diaginertia="1e-4 1e-4 1e-4"/></body></worldbody></mujoco>"""
    )


def torque(
    hinge: mujoco.MjModel, data: mujoco.MjData, s: dict, p: dict[str, float], later: bool
) -> np.ndarray:
    """What the drive is commanded on the measured motion, N m, by the parameters."""
    x, y = p["moment x"], p["moment y"]
    mass = s["mass"] * p["payload"]
    at = np.array([s["reach"] + p["away x"], p["away y"]])
    x, y = x + mass * at[0], y + mass * at[1]
    inertia = p["inertia"] + mass * float(at @ at)
    hinge.body_ipos[1] = [x / HEAVY, y / HEAVY, 0.0]
    hinge.dof_armature[0] = inertia - (x * x + y * y) / HEAVY  # of the heavy body near the axis, and this
    hinge.dof_damping[0] = p["damping"]
    hinge.dof_dampingpoly[0] = [p["quadratic"], p["cubic"]]
    hinge.dof_frictionloss[0] = p["friction"]
    hinge.jnt_stiffness[0] = p["stiffness"]
    hinge.qpos_spring[0] = p["reference"]
    hinge.opt.gravity[:] = [9.81 * np.sin(p["tilt"]), -9.81 * np.cos(p["tilt"]), 0.0]
    needed = np.empty(len(s["q"]))
    for index, (q, dq, ddq) in enumerate(zip(s["q"], s["dq"], s["ddq"], strict=True)):
        data.qpos[0], data.qvel[0], data.qacc[0] = q, dq, ddq
        mujoco.mj_inverse(hinge, data)
        needed[index] = data.qfrc_inverse[0]
    needed += p["offset"]
    if p["delay"]:
        needed = np.interp(s["time"] + p["delay"], s["time"], needed)
    return needed * (p["gain"] if later else 1.0)


def main(folder: Path) -> None:
    """Fit the usual model and it with each effect; print the best."""
    sessions, period = signals(folder)
    every = max(1, round(1 / (RATE * period)))
    for s in sessions:
        for name in ("time", "q", "dq", "ddq", "torque"):
            s[name] = s[name][::every]
    period *= every
    low_pass, step = (
        butter(4, 2 * DECIMATION_CUTOFF * period),
        max(1, int(1 / (period * 8 * DECIMATION_CUTOFF))),
    )
    hinge, largest = model(), max(float(np.abs(s["torque"]).max()) for s in sessions)
    data = mujoco.MjData(hinge)

    def errors(p: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """What is left in the band of the fit, and whether the fit sees it."""
        left, seen = [], []
        for number, s in enumerate(sessions):
            rest = filtfilt(*low_pass, torque(hinge, data, s, p, number > 0) - s["torque"])[::step][5:-5]
            left.append(rest)
            seen.append(np.arange(len(rest)) * FOLDS // len(rest) % 3 != 1)
        return np.concatenate(left), np.concatenate(seen)

    def held_out(
        free: dict[str, tuple[float, float, float]], start: dict[str, float]
    ) -> tuple[float, dict[str, float]]:
        parameters = sysid.ParameterDict()
        for name, (first, low, high) in free.items():
            parameters.add(sysid.Parameter(name, start.get(name, first), low, high))

        def residual(x: np.ndarray, _: sysid.ParameterDict) -> tuple[list[np.ndarray], None, None]:
            left, seen = errors({**NOTHING, **dict(zip(free, np.ravel(x), strict=True))})
            return [left[seen] / largest], None, None

        fitted, _ = sysid.optimize(parameters, residual, optimizer="scipy", verbose=False, max_iters=15)
        values = dict(zip(free, fitted.as_vector().tolist(), strict=True))
        left, seen = errors({**NOTHING, **values})
        return float(np.linalg.norm(left[~seen])), values

    before, usual = held_out(USUAL, {})
    after: dict[str, float] = {}
    for name, more in EFFECTS.items():
        after[name] = held_out({**USUAL, **more}, usual)[0]
    first = min(after, key=lambda name: after[name])
    print(json.dumps({"first": first, "before": before, "after": after[first], "fits": 1 + len(EFFECTS)}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
