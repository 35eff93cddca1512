"""What the parameters of effects can be: sign and range of each, and linear relations between them.

A bounded least squares takes it as it stands: lower ≤ χ ≤ upper and matrix · χ ≥ least. All values are those that are
fitted; where a ratio is reported, its deviation from 1 is fitted, so that a ratio above 0 is a value above −1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.effects.model import Term
from identify.effects.motion import Array, BlockMemory, JointMotion, JointSummary
from identify.effects.parameter import EffectParameter

STEADY_SPEEDS = (1, 3, 5, 7)
"""Which of `JointSummary.speed_quantiles` (2, 10, 50, 90 %) friction must dissipate at, beside standstill and top speed."""


@dataclass(frozen=True, eq=False)
class Admissible:
    """What the parameters of some columns can be: lower ≤ χ ≤ upper and matrix · χ ≥ least.

    lower, upper : (parameters,), infinite where there is no bound
    matrix, least: (relations, parameters), (relations,)
    """

    lower: Array
    upper: Array
    matrix: Array
    least: Array

    def of(self, columns: NDArray[np.bool_], scale: Array) -> "Admissible":
        """The same for some of the columns, the others being zero, with parameters in units of 1/scale."""
        return Admissible(
            self.lower[columns] * scale,
            self.upper[columns] * scale,
            self.matrix[:, columns] / scale,
            self.least,
        )

    def violation(self, values: Array) -> float:
        """By how much values (parameters,) are outside, in units of the worst bound or relation; 0 inside."""
        outside = [self.lower - values, values - self.upper, self.least - self.matrix @ values]
        return float(max(0.0, *(part.max(initial=0.0) for part in outside)))


def admissible_values(
    columns: Sequence[tuple[Term, Mapping[str, float], int]], summaries: Sequence[JointSummary]
) -> Admissible:
    """What the parameters of several terms' columns can be, side by side in the terms' order.

    columns   : term, its constants, and how many columns it has
    summaries : of all joints, by index

    Beside what each effect says of its own parameters, the friction of a joint never drives it: in steady motion at
    every speed, direction, load, position, time and temperature of the record the dissipative effects' torques
    together oppose the motion.
    """
    starts = np.concatenate([[0], np.cumsum([count for *_, count in columns])]).astype(int)
    width = int(starts[-1])
    lower, upper = np.full(width, -np.inf), np.full(width, np.inf)
    rows: list[Array] = []
    least: list[float] = []
    place = {
        (term.effect.name, term.joint): int(start)
        for (term, *_), start in zip(columns, starts[:-1], strict=True)
    }
    for (term, constants, count), start in zip(columns, starts[:-1], strict=True):
        summary = summaries[term.joint]
        listed = named_parameters(term, constants, count, summary)
        lower[start : start + count] = [parameter.lower for parameter in listed]
        upper[start : start + count] = [parameter.upper for parameter in listed]
        for relation in term.effect.relations(summary, constants):
            row = np.zeros(width)
            for (effect, index), coefficient in relation.coefficients.items():
                if (effect, term.joint) in place:
                    row[place[effect, term.joint] + index] = coefficient
            rows.append(row)
            least.append(relation.least)
    for joint, turned in sorted({(t.joint, _turns_with(t, summaries)) for t, *_ in columns}):
        friction = [
            (term, constants, slice(start, start + count))
            for (term, constants, count), start in zip(columns, starts[:-1], strict=True)
            if term.joint == joint and _turns_with(term, summaries) == turned and term.effect.dissipates
        ]
        if friction:
            motion = steady_motion(summaries[joint])
            opposing = np.hstack([t.effect.columns(motion, c) for t, c, _ in friction])
            opposing *= motion.direction[:, None]
            opposed = np.concatenate([np.arange(width)[part] for *_, part in friction])
            if opposing.min(initial=0.0) >= 0 and lower[opposed].min(initial=0.0) >= 0:
                continue  # each by itself opposes the motion already
            distinct = _distinct(opposing)
            spread = np.zeros((len(distinct), width))
            spread[:, opposed] = distinct
            rows += list(spread)
            least += [0.0] * len(distinct)
    return Admissible(lower, upper, np.array(rows).reshape(-1, width), np.array(least))


def _turns_with(term: Term, summaries: Sequence[JointSummary]) -> str:
    """Over whose velocity a term is friction: the joint's own, that of a motor that several joints share, or that of one which
    no gain matrix declares. Each opposes its own motion."""
    if term.effect.rows == "pair":
        return term.effect.name
    shared = term.joint in summaries[term.joint].coupled_motors
    return "motor" if shared and term.effect.rows in ("gear", "motor") else "joint"


def _distinct(rows: Array) -> Array:
    """Different rows (m, k) up to rounding, those of zeros left out; relations through zero, so of unit length."""
    size = np.linalg.norm(rows, axis=1)
    kept = rows[size > 0] / size[size > 0, None]
    rounded = (np.round(kept, 9) + 0.0).tobytes()
    width = kept.itemsize * kept.shape[1]
    # backwards, so that of equal rows the first stays
    last = range(len(kept) - 1, -1, -1)
    return kept[sorted({rounded[place * width : (place + 1) * width]: place for place in last}.values())]


def named_parameters(
    term: Term, constants: Mapping[str, float], count: int, summary: JointSummary
) -> tuple[EffectParameter, ...]:
    """The parameters of a term's columns, (count,); numbered where the term has more columns than names.

    They then have the bounds of the only one that is named; where several are, nothing is known of each.
    """
    listed = term.effect.parameters_of(summary, constants)
    if len(listed) == count:
        return listed
    first = listed[0] if len(listed) == 1 else EffectParameter(listed[0].name, listed[0].unit)
    return tuple(replace(first, name=f"{first.name}[{index + 1}]") for index in range(count))


def own_values(term: Term, constants: Mapping[str, float], count: int, summary: JointSummary) -> Admissible:
    """What the parameters of one term's columns can be whatever else is in the model."""
    listed = named_parameters(term, constants, count, summary)
    name = term.effect.name
    relations = [
        relation
        for relation in term.effect.relations(summary, constants)
        if all(effect == name for effect, _ in relation.coefficients)
    ]
    matrix = np.zeros((len(relations), count))
    for row, relation in zip(matrix, relations, strict=True):
        for (_, index), coefficient in relation.coefficients.items():
            row[index] = coefficient
    return Admissible(
        np.array([parameter.lower for parameter in listed]),
        np.array([parameter.upper for parameter in listed]),
        matrix,
        np.array([relation.least for relation in relations]),
    )


def steady_states(summary: JointSummary) -> Array:
    """States of steady motion that span what a joint's record shows, (states, 6): |q̇|, sign(q̇), τ_out, q, t, T."""
    speeds = sorted({0.0, *summary.speed_quantiles[list(STEADY_SPEEDS)], summary.maximum_speed})
    largest = max(abs(summary.load_range[0]), abs(summary.load_range[1]), 1e-9)
    # just beside zero load too: there friction that depends on the load's sign alone is on its own
    loads = sorted({*summary.load_range, -1e-6 * largest, 1e-6 * largest})
    temperature = summary.temperature_range or (20.0,)
    times = (0.0, max(summary.session_durations, default=0.0))
    sides = (speeds, (-1.0, 1.0), loads, summary.position_quantiles, times, temperature)
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(sides))


def steady_motion(summary: JointSummary) -> JointMotion:
    """Those states as samples of one motion, none after another: no acceleration, no payload, nothing remembered."""
    speed, direction, load, position, time, temperature = steady_states(summary).T
    still = np.zeros_like(speed)
    return JointMotion(
        joint=summary.joint,
        time=time,
        session_time=time,
        experiment_time=time,
        q=position,
        dq=speed * direction,
        ddq=still,
        direction=direction,
        period=summary.period,
        load=load,
        model_torque=load,
        known_load=still,
        payload=0,
        session=0,
        temperature=temperature,
        # at rest the sign of a motor's velocity is that in which it is about to turn, as the joint's direction is
        motor_velocity=np.maximum(speed, 1e-12) * direction,
        motor_acceleration=still,
        motor_share=1.0,
        positions=position[:, None],
        inertial=np.zeros((len(still), 0)),
        memory=BlockMemory(),
        load_slope_of=lambda: still,
        gravity_gradient_of=lambda: np.zeros((len(still), 2)),
        payload_gradient_of=lambda: np.zeros((len(still), 3)),
        payload_columns_of=lambda: np.zeros((len(still), 10)),
    )
