"""What the signals are filtered with, and why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from identify.signals import parallel_filter


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

    def decimation_factor(self, sampling_period: float) -> int:
        """Samples for one decimated sample."""
        return parallel_filter.decimation_factor(self.decimation_cutoff, sampling_period)

    def edge(self) -> float:
        """Seconds trimmed at both ends of a segment, where the filters saw what lies beyond the record.

        One period of each cut-off: the step response of the zero-phase fourth-order filter is then within 1
        % of its end.
        """
        return 1 / min(self.position_cutoff) + 1 / self.decimation_cutoff

    def report(self) -> list[dict[str, Any]]:
        """The choices as plain values for JSON."""
        return [
            {"name": choice.name, "value": choice.value, "unit": choice.unit, "reason": choice.reason}
            for choice in self.choices
        ]
