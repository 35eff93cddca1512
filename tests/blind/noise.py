"""What noise alone leaves of a case's torque, known because the plant is: what a noise floor is measured against.

In closed loop that is the disturbance that was simulated and the noise of the recorded command, in the band that identification
looks at. A plant that is moved as planned is run without what is hidden: what the usual model, which is then right, leaves.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

import identify
from identify.results.diagnosis import JointDiagnosis
from tests.blind.arms import ArmCase
from tests.blind.cases import Case, residual_power
from tests.blind.loops import LoopCase, with_effects
from tests.plants.closed_loop import STEP, simulate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FloorScore:
    """A noise floor beside the truth; all are parts of the measured torque.

    said, low, high : the floor and its interval; None where none was given
    truth           : what noise alone leaves
    error           : of the joint with what was found missing there in the model, which no floor may exceed
    repeats         : whether the motion was asked to repeat at all
    """

    said: float | None
    low: float | None
    high: float | None
    truth: float
    error: float
    repeats: bool


def floor_score(case: object, said: JointDiagnosis, folder: Path) -> FloorScore | None:
    """The floor of a joint; None where the plant does not tell what noise is (rigs, real records).

    folder : the case's record
    """
    if isinstance(case, LoopCase):
        truth, repeats = _disturbance(case, folder), case.arm.period is not None
    elif isinstance(case, Case):
        power, repeats = residual_power(case, {}), case.repeats > 1
        plain, hidden = (_norm([s["v1"] for s in case.run(e).sessions]) for e in ({}, case.effects))
        truth = float(np.sqrt(power)) * plain / hidden
    elif isinstance(case, ArmCase):
        truth, repeats = float(np.sqrt(case.residual_power({}))), case.repeats > 1
    else:
        return None
    low, high = said.noise_floor_interval or (None, None)
    return FloorScore(said.noise_floor, low, high, truth, _error(case, said, folder), repeats)


def _error(case: Case | LoopCase | ArmCase, said: JointDiagnosis, folder: Path) -> float:
    """Relative error of the joint, what was found missing there added to the usual model."""
    added = [f"{name}@{said.joint}" for name in said.missing]
    fit = identify.identify(identify.load_experiment(folder), "usual", add=added).fitted.fit
    place = case.joint if isinstance(case, ArmCase) else 0
    return float(fit.residual[place] / fit.norm[place])


def _norm(commands: list[Array]) -> float:
    return float(np.linalg.norm(np.concatenate(commands)))


def _disturbance(case: LoopCase, folder: Path) -> float:
    """The noise of torque and command in the band of the fit, part of the torque; ends left out."""
    arm = with_effects(case.arm, case.effects)
    pushed: list[Array] = []
    (sessions,) = simulate([arm], pushed)
    document = identify.identify(identify.load_experiment(folder), "usual").document()
    cutoff = next(each.value for each in document.signals if "decim" in each.name or "parallel" in each.name)
    band = butter(4, cutoff, fs=1 / STEP, output="sos")
    away = round(1.0 / STEP)
    noise, torque = [], []
    for index, (disturbance, (_, _, command)) in enumerate(zip(pushed, sessions, strict=True)):
        white = arm.command_noise * np.random.default_rng([arm.seed, index, 11]).standard_normal(len(command))
        noise.append(sosfiltfilt(band, disturbance - white)[away:-away])
        torque.append(sosfiltfilt(band, command * arm.drive_gain)[away:-away])
    return _norm(noise) / _norm(torque)


def within(score: FloorScore, part: float = 0.15) -> bool:
    """Whether a floor that was given is as near to the truth as this part of it."""
    return score.said is not None and abs(score.said - score.truth) <= part * score.truth


def holds(score: FloorScore) -> bool:
    """Whether the interval of a floor that was given holds the truth."""
    return score.low is not None and score.high is not None and score.low <= score.truth <= score.high
