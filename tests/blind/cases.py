"""Hidden effects drawn at random: what is hidden is known here and nowhere else."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

import identify
from tests.plants.hidden_effects import DELAY
from tests.plants.single_joint import (
    HIDDEN,
    LEFT_OUT_OF_EVERY_CATALOGUE,
    Joint,
    Record,
    record,
    write_experiment,
)

CATALOGUED = tuple(name for name in HIDDEN if name not in LEFT_OUT_OF_EVERY_CATALOGUE)
PAYLOADS = ((0.0, 2.0, 4.0), (0.0, 3.0), (0.0, 1.0, 2.5, 5.0), (1.0, 4.0))
"""kg, one session each"""
SHARES = {"strong": (0.5, 0.98), "weak": (0.2, 0.45), "pair": (0.5, 0.9), "uncatalogued": (0.6, 0.98)}
"""Part of the residual's power that the effects cause, from … to, by class."""


HELD = 0.1
"""Periods of sampling to either side of half of one within which no delay is hidden: a command that is held over its period is
early or late by just that, and says nothing of the machine."""
FAINTEST, STRONGEST = 0.002, 8.0
"""strengths between which an effect of the plant is what its name says"""


@dataclass(frozen=True)
class Case:
    """One experiment with something, or nothing, hidden in it.

    kind    : null, noisy null (three times the noise), strong, weak, pair, uncatalogued
    effects : name -> strength
    joint   : its parameters, the noise included
    pace    : factor on the motion's speeds
    shape   : factor on the constants of the effects
    """

    kind: str
    seed: int
    effects: dict[str, float]
    rate: float
    duration: float
    repeats: int
    joint: Joint = field(default_factory=Joint)
    payload_masses: tuple[float, ...] = (0.0, 2.0, 4.0)
    pace: float = 1.0
    shape: float = 1.0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what is hidden."""
        return tuple(self.effects)

    def experiment(self, folder: Path) -> Path:
        """Write the record into the folder; what the diagnosis gets to see."""
        return write_experiment(folder / "experiment", self.run())

    def __str__(self) -> str:
        hidden = ", ".join(f"{name} × {strength:.2g}" for name, strength in self.effects.items())
        return f"{hidden or 'nothing'} (test joint, {self.rate:.0f} Hz, {self.duration:.0f} s, {self.repeats} repeats)"

    def run(self, effects: dict[str, float] | None = None) -> Record:
        """The plant's record, with other effects if asked."""
        return record(
            self.effects if effects is None else effects,
            seed=self.seed,
            joint=self.joint,
            payload_masses=self.payload_masses,
            rate=self.rate,
            duration=self.duration,
            repeats=self.repeats,
            pace=self.pace,
            shape=self.shape,
        )


def made_by_sampling(seconds: float, period: float) -> bool:
    """Whether a delay is no more than what sampling with this period makes."""
    return abs(seconds / period - 0.5) < HELD


def hides_nothing(effects: dict[str, float], rate: float) -> bool:
    """Whether the delay among some effects of the plant is what sampling at this rate (Hz) makes."""
    return "delay" in effects and made_by_sampling(DELAY * effects["delay"], 1 / rate)


def residual_power(case: Case, effects: dict[str, float]) -> float:
    """Squared relative error of the usual model on the case with these effects."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = write_experiment(Path(scratch, "experiment"), case.run(effects))
        return identify.identify(identify.load_experiment(folder), "usual").relative_error ** 2


def scaled(case: Case, random: np.random.Generator) -> Case | None:
    """The case with its strengths scaled so that the effects cause a drawn part of the residual's power.

    None where no strength does, what is hidden leaving no trace in this motion, and where it is what sampling makes.
    """
    low, high = SHARES[case.kind]
    wanted = random.uniform(low, high)
    floor = residual_power(case, {})
    target = floor * wanted / len(case.effects) / (1 - wanted)
    strengths = {}
    for name, trial in case.effects.items():
        strength = reaching(target, lambda s, name=name: residual_power(case, {name: s}) - floor, trial)
        if strength is None:
            return None
        strengths[name] = strength
    return None if hides_nothing(strengths, case.rate) else replace(case, effects=strengths)


def reaching(target: float, power: Callable[[float], float], strength: float) -> float | None:
    """The strength with this power, within a quarter; power grows about as the square of the strength."""
    for _ in range(6):
        found = power(strength)
        if 0.8 * target < found < 1.25 * target:
            return strength
        step = float(np.clip(np.sqrt(target / max(found, 1e-12)), 0.1, 10.0))
        strength = float(np.clip(strength * step, FAINTEST, STRONGEST))
    return None


def draw_joint(random: np.random.Generator, noise: float) -> Joint:
    """A joint of another machine: every parameter up to two and a half times more or less than the default's."""

    def around(value: float) -> float:
        return value * float(np.exp(random.uniform(-1, 1) * np.log(2.5)))

    middle = Joint()
    return Joint(
        link_inertia=around(middle.link_inertia),
        rotor_inertia=around(middle.rotor_inertia),
        first_moment_x=around(middle.first_moment_x),
        first_moment_y=random.uniform(-4.0, 4.0),
        viscous=around(middle.viscous),
        coulomb=around(middle.coulomb),
        offset=random.uniform(-4.0, 4.0),
        counts_per_turn=round(around(middle.counts_per_turn)),
        command_noise=noise * around(middle.command_noise),
        slow_noise=noise * around(middle.slow_noise),
    )


KINDS = ("null", "noisy null", "strong", "strong", "weak", "weak", "pair", "uncatalogued")


def draw(seed: int, index: int) -> Case:
    """The case of an index; the same seed gives the same one."""
    random = np.random.default_rng([seed, index])
    case = None
    while case is None:
        case = _drawn(KINDS[index % len(KINDS)], random)
    return case


def _drawn(kind: str, random: np.random.Generator) -> Case | None:
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
        joint=draw_joint(random, 3.0 if kind == "noisy null" else 1.0),
        payload_masses=PAYLOADS[int(random.integers(len(PAYLOADS)))],
        pace=float(np.exp(random.uniform(np.log(0.7), np.log(1.6)))),
        shape=float(np.exp(random.uniform(np.log(0.6), np.log(1.7)))),
    )
    return scaled(case, random) if names else case
