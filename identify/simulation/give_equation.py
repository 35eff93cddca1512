"""The torque equation of all samples of a fit with links behind their motors: what is left of it beside all that is linear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.effects.admissible import Admissible
from identify.effects.give import Give
from identify.estimation.constrained import admissible_columns, nearest_admissible
from identify.estimation.decimated_rows import DecimatedRows
from identify.estimation.fitted_model import FittedModel
from identify.signals import MotionBlock
from identify.simulation.driven_link import DrivenLink, link_lags

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Stretch:
    """One block of a session: its links, and the decimated samples that take part.

    rows  : of the block where links are followed; at its ends the filters' own transients are left out
    links : by the place of their joint among those that give
    """

    block: MotionBlock
    rows: slice
    links: list[DrivenLink]
    moving: NDArray[np.bool_]


class GiveEquation:
    """The weighted torque equation of all samples: W chi + torque of what gives = Y.

    Where a link begins on its spring is not known: the swings of the stretches' beginnings are columns of their own.
    """

    def __init__(
        self, fitted: FittedModel, kept: NDArray[np.intp], stretches: Sequence[tuple[Stretch, DecimatedRows]]
    ) -> None:
        self._fitted, self._kept = fitted, kept
        self.stretches = [stretch for stretch, _ in stretches]
        self._weights = fitted.fit.weights
        self.seconds = float(sum(stretch.block.time[-1] - stretch.block.time[0] for stretch, _ in stretches))
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
