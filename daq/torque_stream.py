"""Setpoints of drives in cyclic torque mode: the position loop over the bus, closed in SYNC's thread.

In every cycle the positions that the drives sampled at its SYNC are waited for, and the torque that is made of them goes out
in the same cycle, to act from the next SYNC. While the drives hold the axes themselves (mode 8: approach and end) nought is
sent as torque, which they do not look at.
"""

from collections.abc import Callable, Sequence
from typing import Protocol

from daq.safety import StopCause, StopReason
from daq.samples import Phase
from daq.setpoint_stream import SetpointStream
from daq.torque_loop import RunningLoop, TorqueLoop
from drivers.cia402 import Command
from drivers.process_data import DriveStream


class Positions(Protocol):
    """Where the positions of a cycle come from: `position_input.PositionInput`."""

    def take(self) -> list[int] | None:
        """(n) counts of this cycle; None where one did not come in time."""
        ...


class TorqueSetpoints(SetpointStream):
    """A `SetpointStream` that holds the axes by torque once it is told to (`engage`).

    positions : of each cycle
    late      : cycles in a row without all positions, after which the axes are stopped from here
    """

    def __init__(
        self,
        streams: Sequence[DriveStream],
        send: Callable[[int, bytes], None],
        loop: TorqueLoop,
        positions: Positions,
        cycle: float,
        late: int,
    ) -> None:
        super().__init__(streams, send)
        self._loop = RunningLoop(loop, cycle)
        self._positions = positions
        self._engaged = self._freeze = False
        self._reached: list[Sequence[int]] = []
        self._anchor: Sequence[int] | None = None  # counts, where axes are kept whatever their targets
        self._torques = [0] * len(streams)
        self._error = [0.0] * len(streams)
        self._late, self._missing = late, 0
        self.late = 0
        """cycles in which the torque was made of the positions of an earlier one"""

    def engage(self, torques: Sequence[float]) -> None:
        """Hold the axes from the next cycle on, starting from the torques (n), per mille, that hold them now."""
        self._loop.begin(torques)
        self._reached, self._anchor = [], None
        self._freeze = False
        self._engaged = True

    def hold(self, counts: Sequence[int], phase: Phase = Phase.STANDSTILL) -> None:
        """As in every session; while axes are held by torque these are targets for the drives, which are about to hold them
        again, and the loop holds them where it did: another reference would be a jump of its torque."""
        if self._engaged and self._anchor is None and self._reached:
            self._anchor = self._reached[-1]
        super().hold(counts, phase)

    def release(self) -> None:
        """The drives hold the axes themselves."""
        self._engaged = False

    def stop(self, phase: Phase = Phase.STOPPING) -> None:
        """As in every session; and a drive that does not take its quick stop is braked by torque until its power is cut."""
        super().stop(phase)
        self._freeze = True

    def cut(self) -> None:
        """As in every session, without torque from now on."""
        self._engaged = False
        super().cut()

    def tell(self, targets: Sequence[int], torques: Sequence[int] | None) -> None:
        """Send targets, and the loop's torque with what is to be added to it."""
        if not self._engaged:
            super().tell(targets, None)
            return
        measured = self._positions.take()
        self._judge(measured is None)
        if measured is not None:
            # a target takes effect at the next SYNC and is reached at the one after
            reference = (self._reached or [targets])[0]
            if self._freeze:
                self._anchor, self._freeze = measured, False
                self._loop.forget_slope()
            reference = self._anchor or reference
            self._error = [float(wanted - is_) for wanted, is_ in zip(reference, measured, strict=True)]
        self._reached = [*self._reached[-1:], list(targets)]
        self._torques = self._loop.torque(self._error, torques)
        super().tell(targets, self._torques)

    def _judge(self, missed: bool) -> None:
        """Positions that came too late: the torque stands, and not for long."""
        self.late += missed
        self._missing = self._missing + 1 if missed else 0
        if self._missing > self._late and self.trouble is None:
            self.trouble = StopReason(
                StopCause.LOST_FRAMES,
                f"in {self._missing} cycles in a row the positions came too late for the position loop over the bus, which holds"
                " the axes; use a longer cycle, allow real-time priority (docs/install.md), or close what else runs here",
            )
            self.command([Command.QUICK_STOP.value] * len(self._torques))
