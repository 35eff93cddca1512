"""A diagnosis written by hand with NumPy and SciPy: what `diagnosis_speed.py` runs and times.

    python refit_per_candidate.py EXPERIMENT_FOLDER

For one joint about a horizontal axis: filter, differentiate, build the usual model's columns, then for every candidate
effect and every value of its constants append its columns, filter and decimate the whole table, and refit it by least
squares, once with all motion and once without each tenth of every session. The candidate of the least error on the parts
left out comes first. Needs NumPy, SciPy and PyYAML, nothing of ours. Prints one JSON document as its last line.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import yaml
from scipy.signal import butter, filtfilt

FOLDS = 10
POSITION_CUTOFF = 20.0
DECIMATION_CUTOFF = 5.0


def signals(folder: Path) -> tuple[list[dict[str, np.ndarray]], float]:
    """Position, velocity, acceleration, torque, known payload of every session; and the period."""
    description = yaml.safe_load((folder / "experiment.yaml").read_text())
    gain = description["robot"]["joints"][0]["drive_gain"]
    payloads = {payload["name"]: payload for payload in description["payloads"]}
    found, period = [], 0.0
    for session in description["sessions"]:
        header = (folder / session["file"]).open().readline().strip().split(",")
        table = np.loadtxt(folder / session["file"], delimiter=",", skiprows=1)
        columns = dict(zip(header, table.T, strict=True))
        period = float(columns["t"][1] - columns["t"][0])
        q = filtfilt(*butter(4, 2 * POSITION_CUTOFF * period), columns["q1"])
        dq = np.gradient(q, period)
        payload = payloads[session["payload"]]
        found.append(
            {
                "time": columns["t"],
                "q": q,
                "dq": dq,
                "ddq": np.gradient(dq, period),
                "torque": gain * columns["v1"],
                "mass": payload["mass"],
                "reach": payload.get("com", [0.0])[0],
            }
        )
    return found, period


def known_load(s: dict) -> np.ndarray:
    """Torque of the weighed payload."""
    return s["mass"] * (s["reach"] ** 2 * s["ddq"] + 9.81 * s["reach"] * np.cos(s["q"]))


def usual(s: dict) -> np.ndarray:
    """Inertia, gravity, viscous and dry friction, offset, payload."""
    q, dq = s["q"], s["dq"]
    return np.column_stack(
        [s["ddq"], 9.81 * np.cos(q), 9.81 * np.sin(q), dq, np.sign(dq), np.ones_like(q), known_load(s)]
    )


def candidates(s: dict, load: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Name and columns of each candidate, once for every value of its constants."""
    q, dq, time = s["q"], s["dq"], s["time"]
    sign, speed = np.sign(dq), np.abs(dq)
    driving = load * dq > 0
    yield "viscous-asymmetric", speed[:, None]
    yield "viscous-quadratic", (speed * dq)[:, None]
    yield "viscous-cubic", (dq**3)[:, None]
    for exponent in (0.2, 0.35, 0.5, 0.65, 0.8, 1.3):
        yield "viscous-power", (sign * speed**exponent)[:, None]
    for velocity in np.geomspace(0.004, 0.25, 9):
        yield "stribeck", (sign * np.exp(-speed / velocity))[:, None]
    for rotor in (0.0, 0.3, 0.6, 0.9):
        carried = np.abs(load - rotor * 10.0 * s["ddq"])
        yield "load-friction", (carried * sign)[:, None]
        yield (
            "load-friction-asymmetric",
            np.column_stack([carried * sign * driving, carried * sign * ~driving]),
        )
    for velocity in np.geomspace(0.004, 0.25, 7):
        fading = np.abs(load) * sign * np.exp(-speed / velocity)
        yield "load-stribeck", np.column_stack([fading * driving, fading * ~driving])
    for knots in (3, 5, 8, 13):
        places = np.linspace(-1.3, 1.3, knots)
        hats = np.maximum(0, 1 - np.abs(q[:, None] - places) / (places[1] - places[0]))
        yield "friction-position", hats[:, 1:] * sign[:, None]
    for constant in (6.0, 12.0, 25.0, 60.0):
        cold = np.exp(-time / constant)
        yield "friction-warmup", np.column_stack([cold * dq, cold * sign])
    yield "joint-spring", q[:, None]
    for wave in np.linspace(5.0, 120.0, 47):
        ripple = np.column_stack([np.sin(wave * q), np.cos(wave * q)])
        yield "torque-ripple", ripple
        yield "current-ripple", ripple * load[:, None]
    for power in (1.0, 2.0):
        yield "gain-saturation", (np.abs(load) ** power * load)[:, None]
    yield "delay", np.gradient(load, time)[:, None]
    travel = np.abs(np.diff(q, prepend=q[0]))
    for width in np.geomspace(0.001, 0.05, 7):
        kept, state, bristle = np.exp(-travel / width), 0.0, np.empty_like(q)
        for k in range(len(q)):
            state = sign[k] + (state - sign[k]) * kept[k]
            bristle[k] = state
        yield "presliding", bristle[:, None]


def main(folder: Path) -> None:
    """Rank the candidates by the error left out."""
    sessions, period = signals(folder)
    step = max(1, int(1 / (period * 8 * DECIMATION_CUTOFF)))
    low_pass = butter(4, 2 * DECIMATION_CUTOFF * period)

    def reduced(parts: list[np.ndarray]) -> np.ndarray:
        """Filtered, decimated, the edges left out, sessions below each other."""
        return np.concatenate([filtfilt(*low_pass, part, axis=0)[::step][5:-5] for part in parts])

    fold = np.concatenate([np.arange(n) * FOLDS // n for n in (len(s["q"][::step][5:-5]) for s in sessions)])
    target = reduced([s["torque"][:, None] for s in sessions])[:, 0]
    fits = 0

    def held_out(table: np.ndarray) -> float:
        nonlocal fits
        np.linalg.lstsq(table, target, rcond=None)
        error = 0.0
        for left_out in range(FOLDS):
            test = fold == left_out
            fit = np.linalg.lstsq(table[~test], target[~test], rcond=None)[0]
            error += float(np.sum((target[test] - table[test] @ fit) ** 2))
        fits += 1 + FOLDS
        return float(np.sqrt(error / (target @ target)))

    base = reduced([usual(s) for s in sessions])
    start = np.linalg.lstsq(base, target, rcond=None)[0]
    loads = [usual(s)[:, [0, 1, 2, 6]] @ start[[0, 1, 2, 6]] for s in sessions]
    before = held_out(base)
    errors: dict[str, float] = {}
    for options in zip(*(candidates(s, load) for s, load in zip(sessions, loads, strict=True)), strict=True):
        name = options[0][0]
        whole = [
            np.column_stack([usual(s), columns]) for s, (_, columns) in zip(sessions, options, strict=True)
        ]
        errors[name] = min(held_out(reduced(whole)), errors.get(name, np.inf))
    first = min(errors, key=lambda name: errors[name])
    print(json.dumps({"first": first, "fits": fits, "before": before, "after": errors[first]}))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
