"""Cases in closed loop: the disturbance acts inside the position loop, so that motion and torque hold the same noise.

The plant is `tests/plants/closed_loop.py`. Every case has a machine of its own: controller (three kinds), bandwidth (2 to 15 Hz),
colour of the disturbance (corner 1 to 20 Hz), noise of command and encoder, rate of friction's drift.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

import identify
from tests.plants.closed_loop import RUBBER, LoopArm, draw_arm, motion_of, simulate, write_arm

CATALOGUED = {
    "delay": ("delay", 0.004),
    "stribeck": ("stiction", 6.0),
    "viscous-quadratic": ("quadratic", 4.0),
    "joint-spring": ("spring", 5.0),
    "load-friction": ("load_friction", 0.05),
}
"""Field of the arm that hides the effect, and a strength to begin with."""
UNCATALOGUED = {"bumper": ("bumper", 10.0)}
SHARES = {"loop strong": (0.5, 0.95), "loop weak": (0.2, 0.45), "loop uncatalogued": (0.6, 0.95)}
"""Part of the residual's power that the effect causes, from … to."""
KINDS = ("loop null", "loop null", "loop strong", "loop weak", "loop uncatalogued")
TRIED = 2.0 ** np.arange(-2.0, 4.0)
"""strengths that are simulated side by side, times the first"""


@dataclass(frozen=True)
class LoopCase:
    """One machine in closed loop.

    kind    : loop null, loop strong, loop weak or loop uncatalogued
    effects : name -> strength
    """

    kind: str
    seed: int
    effects: dict[str, float]
    arm: LoopArm

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what is hidden."""
        return tuple(self.effects)

    def experiment(self, folder: Path) -> Path:
        """Move the machine; what the diagnosis gets to see."""
        hiding = with_effects(self.arm, self.effects)
        return write_arm(folder / "experiment", hiding, simulate([hiding])[0])

    def __str__(self) -> str:
        hidden = ", ".join(f"{name} × {strength:.2g}" for name, strength in self.effects.items())
        arm = self.arm
        return (
            f"{hidden or 'nothing'} ({arm.controller} {arm.bandwidth:.1f} Hz, disturbance {100 * arm.amplitude:.0f} %"
            f" below {arm.corner:.0f} Hz, drift {100 * arm.drift:.0f} %)"
        )


def with_effects(arm: LoopArm, effects: dict[str, float]) -> LoopArm:
    """The arm with effects in it."""
    fields = {**CATALOGUED, **UNCATALOGUED}
    return replace(arm, **{fields[name][0]: strength for name, strength in effects.items()})


def draw_loop(seed: int, index: int) -> LoopCase:
    """The case of an index; the same seed gives the same one."""
    random = np.random.default_rng([seed, index, 3])
    kind = KINDS[index % len(KINDS)]
    while True:
        case = _drawn(kind, random)
        if case is not None:
            return case


def _drawn(kind: str, random: np.random.Generator) -> LoopCase | None:
    arm = draw_arm(
        random,
        bandwidth=float(np.exp(random.uniform(np.log(2.0), np.log(15.0)))),
        duration=30.0,
        payloads=(0.0, float(random.uniform(3.0, 6.0))),
        counts_per_turn=int(10 ** random.uniform(5.0, 6.0)),
        command_noise=float(random.uniform(0.0, 1.0)),
        drift=float(random.choice([0.0, 0.0, 0.01])),
        period=float(random.uniform(5.0, 9.0)) if random.uniform() < 0.4 else None,
    )
    case = LoopCase(kind, int(random.integers(1 << 30)), {}, arm)
    if kind == "loop null":
        return case
    known = UNCATALOGUED if kind == "loop uncatalogued" else CATALOGUED
    name = str(random.choice(sorted(known)))
    strength = _reaching(arm, name, known[name][1], random.uniform(*SHARES[kind]))
    return None if strength is None else replace(case, effects={name: strength})


def _reaching(arm: LoopArm, name: str, first: float, share: float) -> float | None:
    """The strength that causes this part of the residual's power; None where none that is tried comes near.

    More of an effect leaves more: most machines that cannot be used are known by the weakest and the strongest.
    """
    if name in UNCATALOGUED and max(float(q.max()) for q, _, _ in motion_of(arm)) < RUBBER:
        return None  # never touched
    strengths = [0.0, *(first * TRIED)]
    arms = [with_effects(arm, {name: strength}) for strength in strengths]
    sessions = simulate(arms)

    @cache
    def power(number: int) -> float:
        """Squared error of the usual model with one of the strengths."""
        with tempfile.TemporaryDirectory() as scratch:
            folder = write_arm(Path(scratch), arms[number], sessions[number])
            return identify.identify(identify.load_experiment(folder), "usual").relative_error ** 2

    target = power(0) / (1 - share)
    low, high = 1, len(arms) - 1
    if not power(low) < target < power(high):
        return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if power(middle) < target else (low, middle)
    excess = [max(each - power(0), 1e-12) for each in (power(low), target, power(high))]
    below, wanted, above = np.log(excess)
    between = (wanted - below) / (above - below)
    return float(strengths[low] * (strengths[high] / strengths[low]) ** between)
