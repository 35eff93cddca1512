"""How transmissions give, from the torque of two masses: the equation of motion that a simulation integrates.

The columns of elasticity and backlash are of the first order in what gives: they take the load of the measured motion for what
the gear carries. That tells the effects, but what a rollout integrates has links that swing and fly behind their motors
(`driven_link.py`). Here the torque of such links is taken instead of the columns, and what gives is searched for the least error
of it, the linear parameters being those of least squares beside it (Golub, Pereyra 1973, SIAM J. Numer. Anal. 10). Samples,
filters, weights and bounds are those of the fit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.dynamics.inverse_dynamics import InverseDynamics
from identify.dynamics.payload import payload_parameters
from identify.dynamics.standard_parameters import PARAMETERS_PER_JOINT
from identify.effects.admissible import Admissible
from identify.effects.give import Give
from identify.estimation.constrained import admissible_columns, nearest_admissible
from identify.estimation.context import Slot
from identify.estimation.decimated_rows import DecimatedRows, decimated_rows
from identify.estimation.fitted_model import FittedModel
from identify.recording import SessionEntry
from identify.signals import MotionBlock
from identify.simulation.driven_link import DrivenLink, driven_link, link_lags
from identify.simulation.give_range import GiveRange

Array = NDArray[np.float64]
Hidden = Mapping[str, tuple[float, float]]
"""by a session's file the part of it, s, that a fit does not see"""

ROUNDS = 2
"""passes in which links are driven by the load of the last; parameters move by parts of a thousandth in the second"""

MOST_TRIALS = 12
"""steps of the search in one pass; it ends by itself after three to ten"""


@dataclass(frozen=True, eq=False)
class GiveFit:
    """A fitted model whose joints give.

    fitted : the model, its linear parameters those beside the gives; columns of what gives have none
    gives  : by joint
    """

    fitted: FittedModel
    gives: Mapping[int, Give]


def give_fit(fitted: FittedModel, hidden: Hidden | None = None) -> GiveFit:
    """Fit what gives in a model on the sessions that it was fitted to.

    hidden : parts of sessions to leave out
    Joints that have no inertia in the model (eq. 30 in its linear form) give nothing.
    """
    sought = giving_slots(fitted)
    if not sought:
        return GiveFit(fitted, {})
    if hidden is None:
        kept = fitted.held.get("gives")
        if isinstance(kept, GiveFit):
            return kept
    given = _fit(fitted, sought, hidden or {})
    if hidden is None:
        fitted.held["gives"] = given
    return given


def giving_slots(fitted: FittedModel) -> list[Slot]:
    """The effects of a model that give between motor and link."""
    return [slot for slot in fitted.slots if slot.term.effect.simulated_with(slot.values) == "give"]


@dataclass(frozen=True, eq=False)
class _Stretch:
    """One block of a session: its links, and the decimated samples that take part.

    rows  : of the block where links are followed; at its ends the filters' own transients are left out
    links : by the place of their joint among those that give
    """

    block: MotionBlock
    rows: slice
    links: list[DrivenLink]
    moving: NDArray[np.bool_]


def _fit(fitted: FittedModel, sought: Sequence[Slot], hidden: Hidden) -> GiveFit:
    observation, base = fitted.observation, fitted.observation.base
    numbered = zip(fitted.slots, observation.slot_columns, strict=True)
    giving = np.concatenate([columns for slot, columns in numbered if slot in sought])
    kept = np.setdiff1d(fitted.fit.fitted, giving)
    joints = sorted({slot.term.joint for slot in sought})
    chi = fitted.fit.chi
    stretches = _stretches(fitted, chi[:base], joints, hidden)
    ranges: dict[int, GiveRange] = {}
    for number, joint in enumerate(joints):
        reach = _range_of(fitted, [stretch.links[number] for stretch, _ in stretches], sought)
        if reach is not None:
            ranges[joint] = reach
    if len(ranges) < len(joints):
        able = [slot for slot in sought if slot.term.joint in ranges]
        rest = _fit(fitted, able, hidden) if able else GiveFit(fitted, {})
        return GiveFit(_with_values(rest.fitted, rest.fitted.fit.chi, giving), rest.gives)
    listed = list(ranges.values())
    equation = _Equation(fitted, kept, stretches)
    values = _begun(equation, listed)
    for last in range(ROUNDS - 1, -1, -1):
        values = _searched(equation, listed, values)
        chi = np.zeros(observation.width)
        chi[kept] = equation.linear(_gives(listed, values))
        if last:
            equation = _Equation(fitted, kept, _stretches(fitted, chi[:base], joints, hidden))
    gives = _gives(listed, values)
    given = _with_values(fitted, chi, giving)
    left = equation.deviations(gives) * np.sqrt(fitted.fit.rows)
    given = replace(given, fit=replace(given.fit, residual=left))
    return GiveFit(given, dict(zip(joints, gives, strict=True)))


def _with_values(fitted: FittedModel, chi: Array, giving: NDArray[np.intp]) -> FittedModel:
    """The model with other linear parameters, none of them of what gives."""
    chi = chi.copy()
    chi[giving] = 0.0
    return replace(fitted, fit=replace(fitted.fit, chi=chi, free=None))


def _stretches(
    fitted: FittedModel, chi: Array, joints: Sequence[int], hidden: Hidden
) -> list[tuple[_Stretch, DecimatedRows]]:
    """The blocks of all sessions of a fit with the links of the joints that give, base parameters chi."""
    listed = []
    for entry in fitted.entries:
        begin, end = hidden.get(entry.file, (np.inf, -np.inf))
        rigid = _rigid(fitted, entry, chi)
        blocks = fitted.record.blocks(entry)
        rows_of_blocks = decimated_rows(fitted.record, entry, fitted.slots, fitted.load_from)
        for prepared, rows in zip(blocks, rows_of_blocks, strict=True):
            block = prepared.block
            edge = max(1, block.first // 2)
            inner = slice(edge, len(block.time) - edge)
            # samples whose filter reaches into the left-out ends tell nothing of the links
            reach = 2 * block.first * block.sampling_period
            seen = (rows.time >= block.time[0] + reach) & (rows.time <= block.time[-1] - reach)
            seen &= (rows.time < begin) | (rows.time > end)
            links = [_driven(rigid, block, inner, joint) for joint in joints]
            listed.append((_Stretch(block, inner, links, rows.moving & seen[:, None]), rows))
    return listed


def _rigid(fitted: FittedModel, entry: SessionEntry, chi: Array) -> InverseDynamics:
    base = fitted.record.body.base
    payload = np.zeros(PARAMETERS_PER_JOINT * fitted.record.joints)
    payload[-PARAMETERS_PER_JOINT:-1] = payload_parameters(entry.payload)
    return InverseDynamics(base.geometry, [base.nearest_standard(chi) + payload])


def _driven(rigid: InverseDynamics, block: MotionBlock, rows: slice, joint: int) -> DrivenLink:
    """What drives the link of a joint over some rows of a block."""
    dq = block.dq[rows]

    def loads(q: Array, ddq: Array) -> Array:
        load = rigid.torques(q, dq, ddq)[0]
        return load if block.external is None else load - block.external[rows]

    return driven_link(joint, block.sampling_period, (block.q[rows], block.ddq[rows]), loads)


def _range_of(fitted: FittedModel, links: Sequence[DrivenLink], sought: Sequence[Slot]) -> GiveRange | None:
    """What the give of a joint can be; None where the model has no inertia or no load there."""
    joint = links[0].joint
    inertia = min(float(np.min(link.inertias[:, joint])) for link in links)
    load = max(float(np.max(np.abs(link.load))) for link in links)
    if inertia <= 0.0 or load <= 0.0:
        return None
    summary = fitted.record.summaries[joint]
    kinds = {slot.term.effect.gives for slot in sought if slot.term.joint == joint}
    return GiveRange(
        inertia,
        load,
        summary.span,
        summary.position_resolution,
        spring="spring" in kinds,
        gap="gap" in kinds,
    )


class _Equation:
    """The weighted torque equation of all samples: W chi + torque of what gives = Y.

    Where a link begins on its spring is not known: the swings of the stretches' beginnings are columns of their own.
    """

    def __init__(
        self, fitted: FittedModel, kept: NDArray[np.intp], stretches: Sequence[tuple[_Stretch, DecimatedRows]]
    ) -> None:
        self._fitted, self._kept = fitted, kept
        self.stretches = [stretch for stretch, _ in stretches]
        self._weights = fitted.fit.weights
        tables, measured, joints = [], [], []
        for stretch, rows in stretches:
            for joint, part in enumerate(rows.rows):
                weighted = part[stretch.moving[:, joint]] * self._weights[joint]
                wide = np.zeros((len(weighted), fitted.observation.width))
                wide[:, rows.table.joint_columns[joint]] = weighted[:, :-2]
                tables.append(wide[:, kept])
                measured.append(weighted[:, -2])
                joints.append(np.full(len(weighted), joint))
        columns = np.vstack(tables)
        self._measured, self._joints = np.concatenate(measured), np.concatenate(joints)
        norms = np.linalg.norm(columns, axis=0)
        scale = np.where(norms > 0.0, norms, 1.0)
        self._q, triangle = np.linalg.qr(columns / scale)
        self._triangle = triangle * scale

    def residual(self, gives: Sequence[Give]) -> Array:
        """(samples,) weighted, beside the least squares of all that is linear."""
        torque, swings = self._torque(gives)
        left = self._beside(self._measured - torque)
        if swings.shape[1]:
            basis, _ = np.linalg.qr(self._beside(swings))
            left = left - basis @ (basis.T @ left)
        return left

    def deviations(self, gives: Sequence[Give]) -> Array:
        """(joints,) N m or N, root mean square of what is left of the torque of each joint."""
        left = self.residual(gives)
        each = [left[self._joints == joint] for joint in range(len(self._weights))]
        return np.array([np.sqrt(np.mean(part**2)) if len(part) else 0.0 for part in each]) / self._weights

    def linear(self, gives: Sequence[Give]) -> Array:
        """(kept,) the linear parameters beside gives, inside what they can be."""
        torque, swings = self._torque(gives)
        left = self._measured - torque
        if swings.shape[1]:
            start = np.linalg.lstsq(self._beside(swings), self._beside(left), rcond=None)[0]
            left = left - swings @ start
        least = np.asarray(np.linalg.lstsq(self._triangle, self._q.T @ left, rcond=None)[0], float)
        return nearest_admissible(self._triangle, least, self._admissible)

    @cached_property
    def _admissible(self) -> Admissible:
        whole = admissible_columns(self._fitted.observation, self._fitted.record.summaries)
        kept = self._kept
        known = ~np.any(np.delete(whole.matrix, kept, axis=1) != 0.0, axis=1)
        return Admissible(
            whole.lower[kept], whole.upper[kept], whole.matrix[known][:, kept], whole.least[known]
        )

    def _beside(self, values: Array) -> Array:
        """What the columns leave of values."""
        return values - self._q @ (self._q.T @ values)

    def _torque(self, gives: Sequence[Give]) -> tuple[Array, Array]:
        """(samples,) torque of what gives, and (samples, k) of the links' beginnings, as the columns are filtered."""
        lags = [
            link_lags(give, [stretch.links[number] for stretch in self.stretches])
            for number, give in enumerate(gives)
        ]
        parts: list[Array] = []
        swings: list[tuple[int, Array]] = []
        for place, stretch in enumerate(self.stretches):
            joints, rows = stretch.moving.shape[1], stretch.rows
            lagging = [lag[place] for lag in lags]
            torque = sum(
                link.torque(give, lag) for link, give, lag in zip(stretch.links, gives, lagging, strict=True)
            )
            inner = np.hstack([torque, *(lag.swings for lag in lagging)])
            ends = (rows.start, len(stretch.block.time) - rows.stop)
            table = stretch.block.decimate(np.pad(inner, (ends, (0, 0)), mode="edge"))
            first = joints
            for link, lag in zip(stretch.links, lagging, strict=True):
                count = lag.swings.shape[1]
                if count:
                    moving = stretch.moving[:, link.joint]
                    begun = table[moving, first : first + count] * self._weights[link.joint]
                    swings.append((len(parts) + link.joint, begun))
                first += count
            for joint in range(joints):
                parts.append(table[stretch.moving[:, joint], joint] * self._weights[joint])
        edges = np.concatenate([[0], np.cumsum([len(part) for part in parts])])
        columns = np.zeros((int(edges[-1]), sum(each.shape[1] for _, each in swings)))
        first = 0
        for part, each in swings:
            columns[edges[part] : edges[part + 1], first : first + each.shape[1]] = each
            first += each.shape[1]
        norms = np.linalg.norm(columns, axis=0)
        return np.concatenate(parts), columns[:, norms > 0.0] / norms[norms > 0.0]


def _gives(ranges: Sequence[GiveRange], values: Array) -> list[Give]:
    edges = np.cumsum([0, *(len(each.lower) for each in ranges)])
    return [
        each.give(values[first:last]) for each, first, last in zip(ranges, edges[:-1], edges[1:], strict=True)
    ]


def _begun(equation: _Equation, ranges: Sequence[GiveRange]) -> Array:
    """Where the search begins: of a few values of each joint those with the least error, one joint after the other."""
    chosen = [each.starts()[0] for each in ranges]
    for number, each in enumerate(ranges):
        errors = []
        for start in each.starts():
            tried = [*chosen[:number], start, *chosen[number + 1 :]]
            errors.append(np.linalg.norm(equation.residual(_gives(ranges, np.concatenate(tried)))))
        chosen[number] = each.starts()[int(np.argmin(errors))]
    return np.concatenate(chosen)


def _searched(equation: _Equation, ranges: Sequence[GiveRange], values: Array) -> Array:
    """The values with the least error, from some to begin with."""
    from scipy.optimize import least_squares

    lower = np.concatenate([each.lower for each in ranges])
    upper = np.concatenate([each.upper for each in ranges])
    margin = 1e-6 * (upper - lower)
    search = least_squares(
        lambda tried: equation.residual(_gives(ranges, tried)),
        np.clip(values, lower + margin, upper - margin),
        bounds=(lower, upper),
        x_scale=0.1,
        diff_step=1e-3,
        max_nfev=MOST_TRIALS,
        xtol=1e-4,
        ftol=1e-5,
    )
    return np.asarray(search.x)
