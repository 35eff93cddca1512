"""Plasmodes: a known effect put into the torque of a real record, which for effects of the instant is physically exact.

A motor that had to overcome the effect as well would have been commanded so much more, and the same motion would have come of it.
Noise, controller and everything that the machine has of its own stay as they are.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

import identify
from identify.recording import Session
from identify.recording.experiment_file import EXPERIMENT_FILE, read_experiment_file, write_experiment
from identify.recording.session_csv import write_csv_session

Array = NDArray[np.float64]

RECORDS = ("emps", "tx40", "bam-xl330", "tiago")
TIMES = {"plasmode strong": 1.5, "plasmode weak": 0.6}
"""What the effect adds to the residual of the usual model, in parts of what that leaves (root mean square)."""
KINDS = tuple(TIMES)
SMOOTHED = 0.06
"""s of the polynomial that gives the velocity"""
TRIAL = 0.2
"""part of the torque that is tried first"""
LEAST_LEFT = 0.1
"""Part of an effect's torque that a model must leave for the effect to show beside it."""


@dataclass(frozen=True)
class Motion:
    """One joint in one session: position, velocity, and where between the ends of the record's range, from 0 to 1."""

    position: Array
    velocity: Array
    place: Array
    top: float

    @property
    def direction(self) -> Array:
        """Sign of the velocity, blurred where the joint is about to turn round."""
        return np.tanh(self.velocity / (0.01 * self.top))


Shape = Callable[[Motion, float], Array]
EFFECTS: dict[str, Shape] = {
    "friction-position": lambda m, k: m.direction * np.sin(2 * np.pi * (1.0 + k) * m.place + 6.0 * k),
    "viscous-quadratic": lambda m, k: np.abs(m.velocity) * m.velocity,
    "viscous-asymmetric": lambda m, k: np.abs(m.velocity),
    "stribeck": lambda m, k: m.direction * np.exp(-np.abs(m.velocity) / ((0.03 + 0.09 * k) * m.top)),
    "torque-ripple": lambda m, k: np.sin(2 * np.pi * round(8 + 20 * k) * m.place),
    "joint-spring": lambda m, k: m.place - k,
}
"""Torque by the motion and a number from 0 to 1 that shapes it."""
PLAIN_FRICTION: dict[str, Callable[[Motion], Array]] = {
    "friction-position": lambda m: m.direction,
    "viscous-asymmetric": lambda m: m.velocity,
}
"""What goes with a shape that by itself would drive the joint for half of the time, so that the two together never do, as no
friction does. The usual model has it and takes it up."""


@dataclass(frozen=True)
class PlasmodeCase:
    """A real record with an effect put into one of its joints.

    effects : name -> strength, N m or N root mean square over the record
    form    : 0 to 1, shapes it
    """

    kind: str
    seed: int
    record: str
    joint: int
    effects: dict[str, float]
    form: float

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what is hidden."""
        return tuple(self.effects)

    def experiment(self, folder: Path) -> Path:
        """Write the record with the effect; what the diagnosis gets to see."""
        ((name, strength),) = self.effects.items()
        return with_effect(self.record, self.joint, name, strength, self.form, folder / "experiment")

    def __str__(self) -> str:
        ((name, strength),) = self.effects.items()
        return f"{name} × {strength:.2g} ({self.record}, joint {self.joint + 1})"


def data() -> Path:
    """Folder of the measured records (`COULOMB_MEASURED_DATA`)."""
    return Path(os.environ.get("COULOMB_MEASURED_DATA", Path(__file__).parents[2].parent / "shared" / "data"))


def present() -> tuple[str, ...]:
    """Records that are at hand."""
    return tuple(name for name in RECORDS if (data() / name / EXPERIMENT_FILE).is_file())


def draw_plasmode(seed: int, index: int) -> PlasmodeCase:
    """The case of an index; the same seed and the same records give the same one.

    What the diagnosis of the record itself names at the joint is not hidden there once more.
    """
    random = np.random.default_rng([seed, index, 5])
    kind, records = KINDS[index % len(KINDS)], present()
    while True:
        record = str(random.choice(records))
        joints = known_of(record)
        joint = int(random.integers(len(joints)))
        name = str(random.choice(sorted(set(EFFECTS) - set(joints[joint]))))
        form = float(random.uniform())
        case = PlasmodeCase(kind, int(random.integers(1 << 30)), record, joint, {name: 1.0}, form)
        strength = _scaled(case, TIMES[kind])
        if strength is not None:
            return PlasmodeCase(kind, case.seed, record, joint, {name: strength}, form)


@cache
def known_of(record: str) -> tuple[tuple[str, ...], ...]:
    """What the diagnosis names at each joint of a record as it is."""
    return tuple(joint.missing for joint in _diagnosed(record).document().joints)


@cache
def _diagnosed(record: str) -> identify.Diagnosis:
    return identify.diagnose(identify.load_experiment(data() / record))


@cache
def _own_effects(record: str) -> tuple[str, ...]:
    """Of all joints what the diagnosis of a record adds, as effect@joint."""
    diagnosis = _diagnosed(record)
    added = [f"{term.effect.name}@{diagnosis.joints[term.joint].joint}" for term in diagnosis.added]
    return tuple(dict.fromkeys(added))


def _scaled(case: PlasmodeCase, times: float) -> float | None:
    """The strength that adds this much to what the usual model leaves; None where that model takes up nearly all of it, or
    the model with what the diagnosis of the record itself adds does.

    What is left is linear in the torque, r + s e. Tried with either sign, the product of what the machine leaves and what
    the effect adds falls out: the strength is that of e, whether the machine has something of this shape of its own or not.
    """
    plain = _left(data() / case.record, case.joint)
    trial = TRIAL * plain[1]
    ((name, _),) = case.effects.items()
    with tempfile.TemporaryDirectory() as scratch:
        folders = [
            with_effect(case.record, case.joint, name, sign * trial, case.form, Path(scratch, str(sign)))
            for sign in (1.0, -1.0)
        ]
        power = 0.5 * sum(_left(each, case.joint)[0] ** 2 for each in folders) - plain[0] ** 2
        if power < (LEAST_LEFT * trial) ** 2:
            return None
        own = _own_effects(case.record)
        beside_own = 0.5 * sum(_left(each, case.joint, own)[0] ** 2 for each in folders)
    if beside_own - _left(data() / case.record, case.joint, own)[0] ** 2 < (LEAST_LEFT * trial) ** 2:
        return None
    return float(trial * times * plain[0] / np.sqrt(power))


def _left(folder: Path, joint: int, add: tuple[str, ...] = ()) -> tuple[float, float]:
    """What the usual model and further effects leave on a joint, and the torque there, both root mean square, N m or N."""
    result = identify.identify(identify.load_experiment(folder), "usual", add)
    fit = result.fitted.fit
    count = float(np.sqrt(max(result.document().samples, 1)))
    return float(fit.residual[joint]) / count, float(fit.norm[joint]) / count


def with_effect(record: str, joint: int, name: str, strength: float, form: float, folder: Path) -> Path:
    """Write a record with an effect in it: sessions as read, the commands changed by what the joint's torque is."""
    loaded = identify.load_experiment(data() / record)
    sessions = {entry.file: loaded.read(entry) for entry in loaded.sessions}
    motions = _motions(list(sessions.values()), joint)
    shapes = [EFFECTS[name](motion, form) for motion in motions]
    size = strength / float(np.sqrt(np.mean(np.concatenate(shapes) ** 2)))
    plain = PLAIN_FRICTION.get(name)
    if plain is not None:
        shapes = [
            shape + np.sign(strength) * plain(motion) for shape, motion in zip(shapes, motions, strict=True)
        ]
    share = np.linalg.inv(loaded.drive_gain)[:, joint]
    folder.mkdir(parents=True, exist_ok=True)
    declared = read_experiment_file(data() / record / EXPERIMENT_FILE)
    kept = []
    for (file, session), shape in zip(sessions.items(), shapes, strict=True):
        command = session.command + (size * shape)[:, None] * share
        written = f"{file.partition('.')[0]}.csv"
        write_csv_session(
            folder / written, session.time, session.position, command, session.external, session.temperature
        )
        kept += [each.model_copy(update={"file": written}) for each in declared.sessions if each.file == file]
    write_experiment(folder, declared.model_copy(update={"sessions": tuple(kept)}))
    return folder


def _motions(sessions: list[Session], joint: int) -> list[Motion]:
    """One joint's motion in every session, on the range and top speed of all of them."""
    positions = [session.position[:, joint] for session in sessions]
    velocities = []
    for session, position in zip(sessions, positions, strict=True):
        window = 2 * max(2, round(SMOOTHED / session.sampling_period / 2)) + 1
        velocities.append(savgol_filter(position, window, 2, deriv=1, delta=session.sampling_period))
    low, high = min(each.min() for each in positions), max(each.max() for each in positions)
    top = max(float(np.quantile(np.abs(each), 0.99)) for each in velocities)
    return [
        Motion(position, velocity, (position - low) / (high - low), top)
        for position, velocity in zip(positions, velocities, strict=True)
    ]
