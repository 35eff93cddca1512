"""Motion that the disturbances of a closed loop do not reach, for instruments.

A position controller answers every disturbance of torque, so that the measured motion holds a trace of it, and a
regressor made of that motion is correlated with the noise of the torque. Columns made of these positions are not:

- the positions of another repeat of the same motion, where a session repeats it: the disturbances of two repeats have
  nothing to do with each other, and everything that the motion makes comes again, corners and reversals included;
- the reference motion, where every session has columns `qref1` ... `qrefn`;
- elsewhere the measured positions low-passed to the band of the motion itself, in which the controller is stiff and
  what was commanded is far larger than what a disturbance makes of it.

The mean over repeats is not used: it holds a part of the disturbance of each.
T. Soderstrom, P. Stoica, "Instrumental variable methods for system identification", 1983, chapter 3; M. Gilson,
P. Van den Hof, "Instrumental variable methods for closed-loop system identification", Automatica 41(2), 2005.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.diagnosis.deciding_constants import BAND, MOST
from identify.estimation.instrumental_variable import has_reference, reference_positions
from identify.estimation.record import Record, Samples
from identify.recording import Session
from identify.signals import differentiation
from identify.signals.motion_spectrum import POWER_HELD, pieces_of, velocity_bandwidth
from identify.validation.noise_floor import repeated_stretch

Array = NDArray[np.float64]

BELOW_THE_FILTER = 0.5
"""Of the parallel filter's cut-off: instruments of the whole band of the columns would be the columns themselves."""


@dataclass(frozen=True)
class Instruments:
    """Positions that disturbances do not reach.

    cutoff  : Hz, where each joint's positions are low-passed if there is nothing better
    repeats : of the sessions that repeat their motion by file: start and end of the stretch, and the period, s
    reference : whether the reference motion was recorded
    """

    cutoff: tuple[float, ...]
    repeats: Mapping[str, tuple[float, float, float]]
    reference: bool

    def __call__(self, session: Session) -> Array:
        """(N, n) rad or m."""
        positions = reference_positions(session) if self.reference else self._low_passed(session)
        stretch = self.repeats.get(session.entry.file)
        if stretch is None:
            return positions
        start, stop, period = stretch
        inside = (session.time >= start) & (session.time <= stop)
        later = session.time + period
        other = np.where(later <= stop, later, session.time - period)[inside]
        for joint in range(session.n):
            positions[inside, joint] = np.interp(other, session.time, session.position[:, joint])
        return positions

    def _low_passed(self, session: Session) -> Array:
        """Each segment by itself."""
        positions = np.array(session.position, dtype=float, copy=True)
        for segment in session.segments:
            positions[segment] = differentiation.differentiate(
                positions[segment], session.sampling_period, self.cutoff
            )[0]
        return positions


def instrument_record(record: Record) -> Record:
    """The record with positions that disturbances do not reach; one for each record, its blocks held with it."""
    if record.instruments is None:
        repeats: dict[str, tuple[float, float, float]] = {}
        for entry in record.entries():
            stretch = repeated_stretch(record.samples[entry.file])
            if stretch is not None and _covers(stretch, record.samples[entry.file].time):
                time, period = stretch[0].time, stretch[1]
                repeats[entry.file] = (float(time[0]), float(time[-1]), period)
        reference = all(has_reference(record.session(entry)) for entry in record.entries())
        record.instruments = record.with_positions(Instruments(motion_band(record), repeats, reference))
    return record.instruments


def _covers(stretch: tuple[Samples, float], time: Array) -> bool:
    """Whether a repeated stretch makes up most of a session and has a repeat for all of its motion."""
    covered = stretch[0].time
    whole = covered[-1] - covered[0] >= 2 * stretch[1]
    return bool(whole and covered[-1] - covered[0] >= MOST * (time[-1] - time[0]))


def motion_band(record: Record) -> tuple[float, ...]:
    """(n,) Hz: where each joint's positions are low-passed, from the median session of the fit."""
    highest = BELOW_THE_FILTER * record.settings.decimation_cutoff
    sessions = [record.session(entry) for entry in record.entries()]
    longest = max(session.sampling_period * _longest(session) for session in sessions)
    bands = []
    for joint in range(record.joints):
        held = [
            velocity_bandwidth(
                [np.array(session.position[rows, joint], dtype=float) for rows in pieces_of(session)],
                session.sampling_period,
                POWER_HELD,
            )
            for session in sessions
        ]
        bands.append(float(np.clip(BAND * np.median(held), 1 / longest, highest)))
    return tuple(bands)


def _longest(session: Session) -> int:
    return max(segment.stop - segment.start for segment in session.segments)
