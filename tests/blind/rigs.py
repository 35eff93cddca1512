"""Cases on the simulated rig: sessions recorded over CAN from drives and a mechanism with effects hidden in it.

The mechanism (`drivers/simulated`) and the servo are others than the test joint's, and the motion is what the rig's
own controller makes of a standard plan: nothing is smooth, nothing known exactly.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import config
from daq.excitation.standard_plan import standard_plan
from daq.rig import Rig
from daq.session_events import SessionState
from daq.session_workflow import PayloadSession

RIG = Path(config.__file__).parent / "rigs" / "rx130l-joint3-simulated.yaml"
PAYLOADS = ("none", "disk-3.5", "disk-7")
SECONDS = 30.0

Drawn = dict[str, Any]
Draw = Callable[[np.random.Generator], Drawn]


def between(low: float, high: float) -> Callable[[np.random.Generator], float]:
    """A number between two, equally likely by its logarithm."""
    return lambda random: float(np.exp(random.uniform(np.log(low), np.log(high))))


def _phase(random: np.random.Generator) -> float:
    return float(random.uniform(-np.pi, np.pi))


CATALOGUED: dict[str, Draw] = {
    "joint-spring": lambda r: {"stiffness": between(6, 40)(r), "rest": float(r.uniform(-0.5, 0.5))},
    "torque-ripple": lambda r: {
        "amplitude": between(2, 10)(r),
        "order": float(r.integers(20, 90)),
        "phase": _phase(r),
    },
    "current-ripple": lambda r: {
        "amplitude": between(0.02, 0.06)(r),
        "order": float(r.integers(1, 4)),
        "phase": _phase(r),
    },
    "friction-warmup": lambda r: {"excess": between(0.15, 0.6)(r), "time_constant": between(15, 40)(r)},
    "gain-saturation": lambda r: {"limit": between(22, 40)(r)},
    "delay": lambda r: {"seconds": between(0.0012, 0.0025)(r)},  # not half of the rig's 2 ms
    "payload-mass": lambda r: {"factor": float(1 + r.choice([-1, 1]) * r.uniform(0.04, 0.15))},
    "payload-com": lambda r: {"shift": [0.0, float(r.choice([-1, 1]) * r.uniform(0.03, 0.12)), 0.0]},
    "friction-position": lambda r: {"amplitude": between(0.2, 0.7)(r), "order": 1.0, "phase": _phase(r)},
    "stribeck": lambda r: {"extra": between(3, 15)(r), "velocity": between(0.03, 0.1)(r)},
    "viscous-asymmetric": lambda r: {"difference": between(3, 15)(r)},
    "viscous-quadratic": lambda r: {"coefficient": float(r.choice([-1, 1]) * between(8, 25)(r))},
    "viscous-cubic": lambda r: {"coefficient": float(r.choice([-1, 1]) * between(8, 20)(r))},
    "presliding": lambda r: {"displacement": between(0.003, 0.02)(r)},
}
UNCATALOGUED: dict[str, Draw] = {
    "cable-snag": lambda r: {
        "beyond": float(r.uniform(0.2, 0.8)),
        "stiffness": between(30, 120)(r),
        "chafing": between(5, 30)(r),
    },
    "brake-drag": lambda r: {"torque": between(8, 20)(r), "mean_interval": 4.0, "mean_duration": 2.0},
    "loose-clamp": lambda r: {"mass": between(2, 5)(r), "radius": 1.2, "play": between(0.03, 0.08)(r)},
    "amplifier-dead-band": lambda r: {"band": between(0.2, 0.6)(r)},
}


@dataclass(frozen=True)
class RigCase:
    """One rig.

    kind    : rig null, rig catalogued, rig pair or rig uncatalogued
    effects : as in the rig file's `hidden_effects`
    """

    kind: str
    seed: int
    effects: tuple[Drawn, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what is hidden."""
        return tuple(effect["effect"] for effect in self.effects)

    def experiment(self, folder: Path) -> Path:
        """Drive the payload sessions over the virtual bus; what the diagnosis gets to see.

        Raises RuntimeError when a session does not come to its end.
        """
        rig = Rig.load(self._rig_file(folder))
        experiment = folder / "experiment"
        plan = standard_plan(rig, SECONDS)
        for name in PAYLOADS:
            payload = rig.payload(name)
            with PayloadSession(rig, experiment, plan, payload, "bench") as session:
                check = session.check()
                if not check.ok:
                    raise RuntimeError(check.problems)
                session.confirm_payload(payload.mass)
                session.arm()
                session.start()
                if session.wait() is not SessionState.DONE:
                    raise RuntimeError(f"{self}: {session.reason}")
        return experiment

    def __str__(self) -> str:
        hidden = [
            f"{effect['effect']} {', '.join(f'{k} {v:.2g}' for k, v in effect.items() if isinstance(v, float))}"
            for effect in self.effects
        ]
        return f"{'; '.join(hidden) or 'nothing'} (simulated rig)"

    def _rig_file(self, folder: Path) -> Path:
        """The rig with plain friction, what the usual model holds, and the effects."""
        settings = copy.deepcopy(yaml.safe_load(RIG.read_text(encoding="utf-8")))
        plant = settings["simulated"]["plant"]
        random = np.random.default_rng([self.seed, 1])
        friction = plant["axis"]["friction"]
        friction.update(
            viscous=between(25, 90)(random),
            offset=float(random.uniform(-10, 10)),
            load_driving=0.0,
            load_driving_stribeck=0.0,
            load_backdriving=0.0,
            load_backdriving_stribeck=0.0,
        )
        friction["dry_driving"] = friction["dry_backdriving"] = between(10, 35)(random)
        plant["hidden_effects"] = list(self.effects)
        settings["simulated"]["seed"] = self.seed % 1000
        settings["bus"]["channel"] = f"blind-{self.seed}"
        file = folder / "rig.yaml"
        file.write_text(yaml.safe_dump(settings, sort_keys=False), encoding="utf-8")
        return file


KINDS = ("rig null", "rig catalogued", "rig catalogued", "rig pair", "rig uncatalogued")


def draw_rig(seed: int, index: int) -> RigCase:
    """The case of an index; the same seed gives the same one."""
    random = np.random.default_rng([seed, index])
    kind = KINDS[index % len(KINDS)]
    known = UNCATALOGUED if kind == "rig uncatalogued" else CATALOGUED
    count = {"rig null": 0, "rig pair": 2}.get(kind, 1)
    names = [str(name) for name in random.choice(sorted(known), count, replace=False)]
    effects = tuple({"effect": name, **known[name](random)} for name in names)
    return RigCase(kind, int(random.integers(1 << 20)), effects)
