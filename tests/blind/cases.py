"""Hidden effects drawn at random: what is hidden is known here and nowhere else."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import identify
from tests.plants.single_joint import (
    HIDDEN,
    LEFT_OUT_OF_EVERY_CATALOGUE,
    Joint,
    Record,
    record,
    write_experiment,
)

CATALOGUED = tuple(name for name in HIDDEN if name not in LEFT_OUT_OF_EVERY_CATALOGUE)
SHARES = {"strong": (0.5, 0.98), "weak": (0.2, 0.45), "pair": (0.5, 0.9), "uncatalogued": (0.6, 0.98)}
"""Part of the residual's power that the effects cause, from … to, by class."""


@dataclass(frozen=True)
class Case:
    """One experiment with something, or nothing, hidden in it.

    kind    : null, noisy null (three times the noise), strong, weak, pair, uncatalogued
    effects : name -> strength
    """

    kind: str
    seed: int
    effects: dict[str, float]
    rate: float
    duration: float
    repeats: int
    noise: float

    def run(self, effects: dict[str, float] | None = None) -> Record:
        """The plant's record, with other effects if asked."""
        joint = Joint()
        joint = replace(
            joint, command_noise=self.noise * joint.command_noise, slow_noise=self.noise * joint.slow_noise
        )
        return record(
            self.effects if effects is None else effects,
            seed=self.seed,
            joint=joint,
            rate=self.rate,
            duration=self.duration,
            repeats=self.repeats,
        )


def residual_power(case: Case, effects: dict[str, float]) -> float:
    """Squared relative error of the usual model on the case with these effects."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = write_experiment(Path(scratch, "experiment"), case.run(effects))
        return identify.identify(identify.load_experiment(folder), "usual").relative_error ** 2


def scaled(case: Case, random: np.random.Generator) -> Case:
    """The case with its strengths scaled so that the effects cause a drawn part of the residual's power.

    The power above the floor grows with the square of the strength as long as the effect is small.
    """
    low, high = SHARES[case.kind]
    wanted = random.uniform(low, high)
    floor = residual_power(case, {})
    strengths = {}
    for name, trial in case.effects.items():
        strength = trial
        for _ in range(2):
            above = residual_power(case, {name: strength}) - floor
            part = wanted / len(case.effects)
            target = floor * part / (1 - wanted)
            strength *= float(np.clip(np.sqrt(target / max(above, 1e-12)), 0.02, 5.0))
        strengths[name] = strength
    return replace(case, effects=strengths)


def draw(seed: int, count: int) -> Iterator[Case]:
    """`count` cases; the same seed gives the same ones."""
    random = np.random.default_rng(seed)
    kinds = ("null", "noisy null", "strong", "strong", "weak", "weak", "pair", "uncatalogued")
    for index in range(count):
        kind = kinds[index % len(kinds)]
        names: list[str] = []
        if kind in ("strong", "weak"):
            names = [str(random.choice(CATALOGUED))]
        elif kind == "pair":
            names = [str(name) for name in random.choice(CATALOGUED, 2, replace=False)]
        elif kind == "uncatalogued":
            names = [str(random.choice(sorted(LEFT_OUT_OF_EVERY_CATALOGUE)))]
        case = Case(
            kind=kind,
            seed=int(random.integers(1 << 30)),
            effects=dict.fromkeys(names, 0.3),
            rate=float(random.choice([250.0, 500.0, 1000.0])),
            duration=float(random.choice([30.0, 60.0])),
            repeats=int(random.choice([1, 2, 3])),
            noise=3.0 if kind == "noisy null" else 1.0,
        )
        yield scaled(case, random) if names else case
