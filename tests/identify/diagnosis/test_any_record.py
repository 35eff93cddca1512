"""Any record that `identify` reads is diagnosed: never a traceback, and never a word without evidence behind it."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

import identify

GRAVITY = 9.81


@dataclass(frozen=True)
class Telescope:
    """Prismatic joints that slide on each other along one axis, upright or lying; link k has the mass `masses[k]`.

    The force on joint j accelerates and lifts all links from j on; friction is that of eq. (8).
    """

    masses: tuple[float, ...]
    upright: bool

    def force(self, dq: np.ndarray, ddq: np.ndarray, payload: float) -> np.ndarray:
        """(N, n) N, of the motion's derivatives (N, n)."""
        outward = np.cumsum(np.asarray([*self.masses[:-1], self.masses[-1] + payload])[::-1])[::-1]
        of_tip = np.cumsum(ddq, axis=1)
        found = np.empty_like(dq)
        for joint in range(dq.shape[1]):
            moved = [*self.masses[joint:-1], self.masses[-1] + payload]
            found[:, joint] = of_tip[:, joint:] @ np.asarray(moved)
        return found + outward * GRAVITY * self.upright + 20.0 * dq + 8.0 * np.sign(dq)


def motion(kind: str, time: np.ndarray, random: np.random.Generator, joints: int) -> np.ndarray:
    """(N, n) positions, m."""
    if kind == "rest":
        return np.zeros((len(time), joints))
    span = time[-1] - time[0]
    if kind == "one way":
        phase = np.clip(time[:, None] / span, 0.0, 1.0)
        return random.uniform(0.1, 0.5, joints) * (phase - np.sin(2 * np.pi * phase) / (2 * np.pi))
    own = np.zeros((len(time), joints))
    for _ in range(3):
        frequency = (
            random.uniform(0.2, 2.0, joints) if kind == "free" else random.integers(1, 4, joints) / 1.0
        )
        own += random.uniform(0.02, 0.1, joints) * np.sin(2 * np.pi * frequency * time[:, None])
    return own


def write(
    folder: Path, kind: str, joints: int, rate: float, durations: list[float], payloads: bool, seed: int
) -> Path:
    """An experiment of a telescope with these sessions."""
    random = np.random.default_rng(seed)
    arm = Telescope(tuple(random.uniform(1.0, 6.0, joints)), bool(random.integers(2)))
    described = [
        {"name": f"x{j + 1}", "type": "prismatic", "alpha": 0.0, "d": 0.0, "theta": 0.0, "r": 0.0}
        | {"drive_gain": 20.0, "motor_ratio": 50.0}
        for j in range(joints)
    ]
    masses = [0.0, 2.0] if payloads else [0.0]
    sessions = []
    for index, duration in enumerate(durations):
        time = np.arange(max(8, round(duration * rate))) / rate
        q = motion(kind, time, random, joints)
        dq = np.gradient(q, time, axis=0)
        ddq = np.gradient(dq, time, axis=0)
        payload = index % len(masses)
        force = arm.force(dq, ddq, masses[payload])
        command = force / 20.0 + 0.02 * random.standard_normal(q.shape)
        q = np.round(q / 2e-6) * 2e-6
        names = ["t", *(f"q{j + 1}" for j in range(joints)), *(f"v{j + 1}" for j in range(joints))]
        np.savetxt(
            folder / f"session-{index:02d}.csv",
            np.column_stack([time, q, command]),
            fmt="%.9g",
            delimiter=",",
            header=",".join(names),
            comments="",
        )
        sessions.append({"file": f"session-{index:02d}.csv", "payload": f"p{payload}"})
    document = {
        "format": 1,
        "name": "any",
        "robot": {"gravity": [0.0, 0.0, -GRAVITY if arm.upright else 0.0], "joints": described},
        "payloads": [{"name": f"p{index}", "mass": mass} for index, mass in enumerate(masses)],
        "sessions": sessions,
    }
    (folder / "experiment.yaml").write_text(yaml.safe_dump(document))
    return folder


def check(said: identify.Diagnosis) -> None:
    """What holds of every diagnosis."""
    assert said.to_json()
    for joint in said.joints:
        assert joint.verdict in ("missing", "adequate", "unexplained")
        document = joint.document()
        justified = {each.effect for each in document.candidates if each.justified}
        assert set(document.missing) <= justified
        assert bool(document.missing) or document.verdict != "missing"
        assert all(0 <= each.probability <= 1 for each in document.candidates if each.probability is not None)


@pytest.mark.parametrize("kind", ["one way", "rest", "free", "periodic"])
@settings(
    max_examples=3,
    deadline=None,
    phases=(Phase.explicit, Phase.reuse, Phase.generate),  # a diagnosis takes too long to shrink by
    suppress_health_check=list(HealthCheck),
)
@given(data=st.data())
def test_any_record_is_diagnosed_or_refused_in_words(kind, data):
    rate = data.draw(st.sampled_from([50.0, 100.0, 250.0, 1000.0, 4000.0, 10_000.0]), label="rate")
    joints = data.draw(st.integers(1, 7 if rate <= 250 else 2), label="joints")
    longest = 8.0 if rate <= 1000 else 2.0
    durations = data.draw(st.lists(st.floats(0.5, longest), min_size=1, max_size=3), label="durations")
    payloads = data.draw(st.booleans(), label="payloads")
    seed = data.draw(st.integers(0, 1000), label="seed")
    with tempfile.TemporaryDirectory() as scratch:
        folder = write(Path(scratch), kind, joints, rate, durations, payloads, seed)
        try:
            identify.identify(identify.load_experiment(folder))
        except identify.InputError:  # in words, which `test_cutoffs.py` and others look at
            return
        check(identify.diagnose(identify.load_experiment(folder)))
