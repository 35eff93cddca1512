"""What the signals are filtered with, and why."""

from __future__ import annotations

from dataclasses import dataclass

from identify.signals import parallel_filter

SLOWEST_ROWS = 1000.0
"""Hz; the rows of a block come at least at this rate, or that of the session."""
ROWS_TIMES_POSITION = 10.0
ROWS_TIMES_DECIMATION = 20.0
"""And at least so many times faster than the cut-offs."""


@dataclass(frozen=True)
class Choice:
    """One chosen number with its reason, for the result."""

    name: str
    value: float
    unit: str
    reason: str


@dataclass(frozen=True)
class SignalSettings:
    """Cut-offs of the position filter and of the parallel filter."""

    position_cutoff: tuple[float, ...]
    """Hz, one for each joint."""
    decimation_cutoff: float
    """Hz, of the parallel filter on Y and every column of W; one for all joints."""
    choices: tuple[Choice, ...] = ()
    """Every number with its reason."""

    def stride(self, sampling_period: float) -> int:
        """Samples of the session for one row of a block: more than one only for sessions faster than a
        kilohertz.

        Regressor columns need not be computed five times a millisecond when the positions are low-passed at
        50 Hz; the measured columns are low-passed before rows are left out. A kilohertz keeps what columns
        make of the motion (the ripple of a motor at full speed) clear of aliasing, and so do the factors
        above the cut-offs.
        """
        slowest = max(
            SLOWEST_ROWS,
            ROWS_TIMES_POSITION * max(self.position_cutoff),
            ROWS_TIMES_DECIMATION * self.decimation_cutoff,
        )
        return max(1, int(1 / (sampling_period * slowest) + 1e-9))

    def decimation_factor(self, sampling_period: float) -> int:
        """Samples of the session for one decimated sample."""
        stride = self.stride(sampling_period)
        return stride * parallel_filter.decimation_factor(self.decimation_cutoff, stride * sampling_period)

    def edge(self) -> float:
        """Seconds trimmed at both ends of a segment, where the filters saw what lies beyond the session.

        The step response of the zero-phase filter comes within 0.6 % of its end after 1.5 periods of its
        cut-off and within 2 % after one. The accelerations must be right to the former; the parallel
        filter, which treats Y and W alike at the border too, only spreads what is left.
        """
        return 1.5 / min(self.position_cutoff) + 1.0 / self.decimation_cutoff
