"""A plant for tests: joints of which two neighbours turn one motor or belt more, which no gain matrix declares.

It shares no line with `identify`. The links are a gantry of slides, or the planar arm of `planar_arm.py`; motions are sums of
sines. Everything is SI.

    tau_j = load_j + Ia_j q_j'' + FV_j q_j' + FC_j sign q_j' + c_j (FVM w + FCM sign w + IaM w'')
    w     = q_own' + side q_before'                       c_own = 1, c_before = side, of all others 0
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

from tests.plants.hidden_effects import GRAVITY
from tests.plants.planar_arm import draw_planar_arm
from tests.plants.session_table import session_text

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Belt:
    """What the joint `own` and the one before it turn together: with the sum of their speeds (side 1) or the difference (-1)."""

    own: int
    side: int
    viscous: float
    dry: float
    inertia: float = 0.0

    def torques(self, dq: Array, ddq: Array) -> Array:
        """(N, n) of the motion (N, n)."""
        turns = np.zeros(dq.shape[1])
        turns[self.own], turns[self.own - 1] = 1.0, self.side
        w, rate = dq @ turns, ddq @ turns
        torque = self.viscous * w + self.dry * np.sign(w) + self.inertia * rate
        return np.asarray(np.outer(torque, turns))


def write_gantry(folder: Path, belts: tuple[Belt, ...], *, seed: int, joints: int = 2) -> Path:
    """Slides of 12, 8 and 5 kg, each across the others, with belts."""
    masses = np.array([12.0, 8.0, 5.0])[:joints]
    described = [
        {"name": "x", "type": "prismatic", "alpha": 0.0, "d": 0.0, "theta": 0.0, "r": 0.0},
        {"name": "y", "type": "prismatic", "alpha": np.pi / 2, "d": 0.0, "theta": np.pi / 2, "r": 0.0},
        {"name": "z", "type": "prismatic", "alpha": np.pi / 2, "d": 0.0, "theta": 0.0, "r": 0.0},
    ][:joints]
    carried = np.cumsum(masses[::-1])[::-1]

    def loads(q: Array, dq: Array, ddq: Array, payload: float) -> Array:
        return np.asarray(ddq * (carried + payload))

    return _write(folder, belts, seed, described, [0.0, 0.0, 0.0], loads, 0.0, 0.35, (4.0, 3.0))


def write_arm(folder: Path, belts: tuple[Belt, ...], *, seed: int, joints: int = 3) -> Path:
    """The planar arm with belts; on its parallel axes the rotor of a sum is what a link is as well."""
    arm = draw_planar_arm(np.random.default_rng(seed), joints)
    described = [
        {"name": f"j{place + 1}", "type": "revolute", "alpha": 0.0, "theta": 0.0, "r": 0.0}
        | {"d": arm.lengths[place - 1] if place else 0.0}
        for place in range(joints)
    ]
    return _write(
        folder, belts, seed, described, [0.0, -GRAVITY, 0.0], arm.loads, arm.joints[-1].reach, 1.2, (6.0, 4.0)
    )


def _write(
    folder: Path,
    belts: tuple[Belt, ...],
    seed: int,
    described: Sequence[dict[str, object]],
    gravity: Sequence[float],
    loads: Callable[[Array, Array, Array, float], Array],
    reach: float,
    span: float,
    friction: tuple[float, float],
) -> Path:
    """Two sessions of 40 s, without payload and with 3 kg at `reach` on the last link's x axis.

    span     : rad or m, of each joint's sines
    friction : viscous and dry, of each joint
    """
    folder.mkdir(parents=True, exist_ok=True)
    count, rate, duration = len(described), 250.0, 40.0
    random = np.random.default_rng([seed, 7])
    time = np.arange(round(duration * rate)) / rate
    sessions = []
    for index, payload in enumerate((0.0, 3.0)):
        q, dq, ddq = (np.zeros((len(time), count)) for _ in range(3))
        for place in range(count):
            for pulse in 2 * np.pi * random.uniform(0.08, 0.7, 5):
                size, phase = span * random.uniform(0.2, 0.4), random.uniform(0, 2 * np.pi)
                q[:, place] += size * np.sin(pulse * time + phase)
                dq[:, place] += size * pulse * np.cos(pulse * time + phase)
                ddq[:, place] -= size * pulse**2 * np.sin(pulse * time + phase)
        torque = loads(q, dq, ddq, payload) + 0.6 * ddq
        torque += friction[0] * dq + friction[1] * np.sign(dq)
        for belt in belts:
            torque += belt.torques(dq, ddq)
        command = np.round((torque + 0.15 * random.standard_normal(torque.shape)) / 20.0, 5)
        columns = {"t": time}
        columns |= {f"q{place + 1}": np.round(q[:, place] / 1e-5) * 1e-5 for place in range(count)}
        columns |= {f"v{place + 1}": command[:, place] for place in range(count)}
        file = f"session-{index}.csv"
        text = session_text(list(columns.values()), list(columns), ["%.9g"] * len(columns))
        (folder / file).write_text(text, encoding="ascii")
        sessions.append({"file": file, "payload": f"m{index}"})
    document = {
        "format": 1,
        "name": "shared-belts",
        "robot": {"gravity": gravity, "joints": [each | {"drive_gain": 20.0} for each in described]},
        "payloads": [
            {"name": f"m{place}", "mass": 3.0 * place, "com": [reach, 0.0, 0.0]} for place in range(2)
        ],
        "sessions": sessions,
    }
    (folder / "experiment.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    return folder
