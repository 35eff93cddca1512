"""Cases with two or three coupled joints, one of which hides something: whether the effect is named where it is.

The plant is `tests/plants/planar_arm.py`. Strengths are scaled as for the test joint, by what the usual model leaves
at the joint.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import identify
from tests.blind.cases import hides_nothing, reaching
from tests.plants.planar_arm import OF_ONE_JOINT, PlanarArm, draw_planar_arm, record_arm

SHARES = {"arm strong": (0.5, 0.98), "arm weak": (0.2, 0.45)}
"""Part of the residual's power at the joint that the effect causes, from … to."""
KINDS = ("arm null", "arm strong", "arm strong", "arm weak", "arm weak")


@dataclass(frozen=True)
class ArmCase:
    """One arm.

    kind    : arm null, arm strong or arm weak
    joint   : where the effect hides
    effects : name -> strength
    """

    kind: str
    seed: int
    arm: PlanarArm
    joint: int
    effects: dict[str, float]
    payloads: tuple[float, ...]
    rate: float
    repeats: int
    pace: float
    shape: float

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what is hidden."""
        return tuple(self.effects)

    def experiment(self, folder: Path) -> Path:
        """Move the arm; what the diagnosis gets to see."""
        return self.recorded(folder / "experiment", self.effects)

    def recorded(self, folder: Path, effects: dict[str, float]) -> Path:
        """The same arm's record with other effects at the joint."""
        return record_arm(
            folder,
            self.arm,
            self.joint,
            effects,
            seed=self.seed,
            payloads=self.payloads,
            rate=self.rate,
            repeats=self.repeats,
            pace=self.pace,
            shape=self.shape,
        )

    def residual_power(self, effects: dict[str, float]) -> float:
        """Squared relative error of the usual model at the joint with these effects."""
        with tempfile.TemporaryDirectory() as scratch:
            folder = self.recorded(Path(scratch), effects)
            fit = identify.identify(identify.load_experiment(folder), "usual").fitted.fit
        return float(fit.residual[self.joint] / fit.norm[self.joint]) ** 2

    def __str__(self) -> str:
        hidden = ", ".join(f"{name} × {strength:.2g}" for name, strength in self.effects.items())
        where = f" at joint {self.joint + 1} of {len(self.arm.joints)}"
        return f"{hidden or 'nothing'}{where if hidden else ''} (planar arm, {self.rate:.0f} Hz, {self.repeats} repeats)"


def draw_arm_case(seed: int, index: int) -> ArmCase:
    """The case of an index; the same seed gives the same one."""
    random = np.random.default_rng([seed, index, 11])
    kind = KINDS[index % len(KINDS)]
    while True:
        case = _drawn(kind, random)
        if case is not None:
            return case


def _drawn(kind: str, random: np.random.Generator) -> ArmCase | None:
    count = int(random.integers(2, 4))
    case = ArmCase(
        kind=kind,
        seed=int(random.integers(1 << 30)),
        arm=draw_planar_arm(random, count),
        joint=int(random.integers(count)),
        effects={},
        payloads=(0.0, float(random.uniform(1.5, 4.0))),
        rate=float(random.choice([250.0, 500.0])),
        repeats=int(random.choice([1, 2])),
        pace=float(np.exp(random.uniform(np.log(0.7), np.log(1.6)))),
        shape=float(np.exp(random.uniform(np.log(0.6), np.log(1.7)))),
    )
    if kind == "arm null":
        return case
    name, share = str(random.choice(OF_ONE_JOINT)), random.uniform(*SHARES[kind])
    floor = case.residual_power({})
    target = floor * share / (1 - share)
    strength = reaching(target, lambda s: case.residual_power({name: s}) - floor, 0.3)
    if strength is None or hides_nothing({name: strength}, case.rate):
        return None
    return replace(case, effects={name: strength})
