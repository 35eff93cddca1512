"""What a simulation starts from and is compared with: the motion of a session at the rate of its rows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.estimation.record import Record
from identify.recording import SessionEntry
from identify.signals import MotionBlock

Array = NDArray[np.float64]


LARGEST_STEP = 4e-3
"""s between rows of the measured motion that a simulation is driven by and compared with, where the record is faster; the
torque between two rows is their mean, so that no impulse is lost"""


@dataclass(frozen=True)
class Travel:
    """The positions that the states of effects with memory follow: every row of the record, from the first that the fit sees.

    q         : (M, n) rad or m
    direction : (n,) -1, 0 or 1, of the first
    rows      : (N,) where the rows of a measured motion stand in it
    """

    q: Array
    direction: Array
    rows: NDArray[np.intp]


@dataclass(frozen=True)
class MeasuredMotion:
    """One stretch of a session without a hole, the ends that the filters need left out; SI units.

    q, dq, ddq : (N, n) as the encoder saw it, which is on the motor
    torque     : (N, n) joint torque g_f v as recorded (eq. 7), N m or N
    command    : (N, n) the recorded command, unit of the drive gain
    resting    : (N, n) whether the joint stands still
    recorded   : (N, n) mean of the positions as recorded in the `rows_in_one` rows of the record since the row before
    travel     : None where nothing is known of the joints' way but these rows
    """

    period: float
    time: Array
    q: Array
    dq: Array
    ddq: Array
    direction: Array
    torque: Array
    command: Array
    external: Array | None
    temperature: Array | None
    resting: NDArray[np.bool_]
    recorded: Array
    extra: dict[str, Array]
    rows_in_one: int = 1
    travel: Travel | None = None

    def __len__(self) -> int:
        return len(self.time)

    @property
    def span(self) -> Array:
        """(n,) range of the recorded positions, rad or m; above zero."""
        return np.maximum(np.ptp(self.q, axis=0), 1e-9)

    @property
    def travelled(self) -> Travel:
        """`travel`, or the way of these rows."""
        return self.travel or Travel(self.q, np.sign(self.direction[0]), np.arange(len(self)))

    def _travel_of(self, part: slice) -> Travel | None:
        return self.travel and replace(self.travel, rows=self.travel.rows[part])

    def rows(self, part: slice) -> MeasuredMotion:
        """Some rows of it."""
        return replace(
            self,
            time=self.time[part],
            q=self.q[part],
            dq=self.dq[part],
            ddq=self.ddq[part],
            direction=self.direction[part],
            torque=self.torque[part],
            command=self.command[part],
            external=None if self.external is None else self.external[part],
            temperature=None if self.temperature is None else self.temperature[part],
            resting=self.resting[part],
            recorded=self.recorded[part],
            extra={name: values[part] for name, values in self.extra.items()},
            travel=self._travel_of(part),
        )

    def thinned(self) -> MeasuredMotion:
        """Every few rows of a record that is faster than a simulation needs; measured columns are means around them."""
        stride = max(1, int(LARGEST_STEP / self.period + 1e-9))
        if stride == 1:
            return self

        def mean(values: Array) -> Array:
            # trapezoidal weights: half of each outer row belongs to the neighbours
            padded = np.pad(values, ((stride, stride), (0, 0)), mode="edge")
            weights = np.convolve(np.ones(stride), np.ones(stride)) / stride**2
            smooth = sum(
                weight * padded[1 + shift : 1 + shift + len(values)] for shift, weight in enumerate(weights)
            )
            return np.asarray(smooth)[::stride]

        earlier = np.pad(self.recorded, ((stride - 1, 0), (0, 0)), mode="edge")
        behind = np.lib.stride_tricks.sliding_window_view(earlier, stride, axis=0).mean(axis=-1)
        return replace(
            self,
            period=stride * self.period,
            time=self.time[::stride],
            q=self.q[::stride],
            dq=self.dq[::stride],
            ddq=self.ddq[::stride],
            direction=self.direction[::stride],
            torque=mean(self.torque),
            command=mean(self.command),
            external=None if self.external is None else mean(self.external),
            temperature=None if self.temperature is None else self.temperature[::stride],
            resting=self.resting[::stride],
            recorded=behind[::stride],
            rows_in_one=stride,
            extra={name: values[::stride] for name, values in self.extra.items()},
            travel=self._travel_of(slice(None, None, stride)),
        )


def measured_motions(
    record: Record, entry: SessionEntry, extra: tuple[str, ...] = ()
) -> list[MeasuredMotion]:
    """The stretches of a session, one for each segment that the filters leave something of.

    extra : names of further columns of the session to take along, e.g. the reference position of a controller; `qref` of a
            recording of ours are its setpoints
    Raises InputError: the session's file is wrong, or shorter than the filters need.
    """
    columns_of = record.experiment.read_with_setpoints(entry).extra if extra else {}
    parts: dict[int, list[tuple[MotionBlock, slice, Array]]] = {}
    for prepared in record.blocks(entry):
        block = prepared.block
        # the rows behind the last decimated sample belong to the next block
        core = slice(block.first, block.first + block.factor * block.count)
        parts.setdefault(block.segment, []).append((block, core, prepared.torque[core]))
    motions = []
    for listed in parts.values():
        blocks = [(block, core) for block, core, _ in listed]
        dq = np.concatenate([block.dq[core] for block, core in blocks])
        q = np.concatenate([block.q[core] for block, core in blocks])
        first, before = blocks[0][0], blocks[0][1].start
        travel = Travel(
            np.concatenate([first.q[:before], q]), np.sign(first.direction[0]), before + np.arange(len(q))
        )
        motions.append(
            MeasuredMotion(
                period=blocks[0][0].sampling_period,
                time=np.concatenate([block.time[core] for block, core in blocks]),
                q=q,
                dq=dq,
                ddq=np.concatenate([block.ddq[core] for block, core in blocks]),
                direction=np.concatenate([block.direction[core] for block, core in blocks]),
                torque=np.concatenate([torque for _, _, torque in listed]),
                command=np.concatenate([block.command[core] for block, core in blocks]),
                external=_joined([None if b.external is None else b.external[c] for b, c in blocks]),
                temperature=_joined([None if b.temperature is None else b.temperature[c] for b, c in blocks]),
                resting=np.abs(dq) <= record.rest_speed,
                recorded=np.concatenate([block.position[core] for block, core in blocks]),
                extra={
                    name: np.concatenate(
                        [np.asarray(columns_of[name][block.rows], float)[core] for block, core in blocks]
                    )
                    for name in extra
                    if name in columns_of
                },
                travel=travel,
            ).thinned()
        )
    return motions


def _joined(parts: list[Array | None]) -> Array | None:
    present = [part for part in parts if part is not None]
    return np.concatenate(present) if present else None
