"""What the drives are told in every cycle: controlword and target, sent in cycle k for cycle k+1.

Everything is computed beforehand; in the rhythm of SYNC there is only packing and sending. `on_cycle` runs in
SYNC's thread, the rest in the thread that watches the samples; what passes between them are whole objects,
replaced and never changed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from daq.safety import StopReason
from daq.samples import Phase
from drivers.process_data import DriveStream

_REMEMBERED = 1 << 14
"""cycles whose setpoint and phase are kept until their samples have come; 16 s at 1 kHz"""


@dataclass(frozen=True)
class Trajectory:
    """Targets to drive through.

    counts : (L, n) int32, target of every axis in every cycle
    phase : (L,) uint8, `Phase` of every cycle
    torque_offset : (L, n) int16, per mille of the rated torque, where the drives are mapped to take one; it is nought in every
        other cycle, and from a stop on
    """

    counts: NDArray[np.int32]
    phase: NDArray[np.uint8]
    torque_offset: NDArray[np.int16] | None = None

    def __len__(self) -> int:
        return len(self.counts)

    def split(self) -> tuple["Trajectory", "Trajectory"]:
        """The way to where the plan begins, with one cycle there, and the plan."""
        begin = int((self.phase == Phase.PLAN).argmax())
        way = Trajectory(self.counts[: begin + 1], np.full(begin + 1, Phase.APPROACH, np.uint8))
        offset = None if self.torque_offset is None else self.torque_offset[begin:]
        return way, Trajectory(self.counts[begin:], self.phase[begin:], offset)


class SetpointStream:
    """Sends the drives' setpoints.

    streams : the axes' process data
    send : `send(can_id, data)`
    """

    def __init__(self, streams: Sequence[DriveStream], send: Callable[[int, bytes], None]) -> None:
        n = len(streams)
        self._send = send
        self._receivers = [(stream.receive.can_id, stream.packed) for stream in streams]
        self._with_torque = [
            (stream.receive.can_id, stream.packed_with_torque)
            for stream in streams
            if stream.torque_entry is not None
        ]
        self._controlwords = [0] * n
        self._held: list[int] | None = None
        self._trajectory: Trajectory | None = None
        self._first_cycle = 0
        self._phase = Phase.STANDSTILL
        self._setpoint_of_cycle = np.zeros((_REMEMBERED, n), np.int32)
        self._phase_of_cycle = np.zeros(_REMEMBERED, np.uint8)
        self.cycle = -1
        self._length = self._before_plan = 0
        self.done = 0
        """cycles of the trajectory that have been sent"""
        self.trouble: StopReason | None = None
        """why the setpoints could not be sent as they should; the axes are being stopped"""

    def on_cycle(self, cycle: int) -> None:
        """SYNC `cycle` went out: send what takes effect at the next."""
        self.cycle = cycle
        trajectory = self._trajectory
        torques: Sequence[int] | None = None
        slot = (cycle + 1) % _REMEMBERED
        if trajectory is not None:
            if self._first_cycle < 0:
                self._first_cycle = cycle
            place = cycle - self._first_cycle
            if place < len(trajectory):
                targets: Sequence[int] = trajectory.counts[place].tolist()
                phase = int(trajectory.phase[place])
                self.done = place + 1
            else:
                targets = trajectory.counts[-1].tolist()
                phase = Phase.STANDSTILL
            self._held = list(targets)
            if trajectory.torque_offset is not None and place < len(trajectory):
                torques = cast("Sequence[int]", trajectory.torque_offset[place].tolist())
        else:
            if self._held is None:
                return
            targets, phase = self._held, self._phase
        self._remember(slot, targets, phase)
        self.tell(targets, torques)

    def tell(self, targets: Sequence[int], torques: Sequence[int] | None) -> None:
        """Send every axis its controlword, its target, and its torque beside it, nought where None."""
        if torques is None:
            for (identifier, pack), controlword, target in zip(
                self._receivers, self._controlwords, targets, strict=True
            ):
                self._send(identifier, pack(controlword, target))
            return
        for (identifier, pack), *values in zip(
            self._with_torque, self._controlwords, targets, torques, strict=True
        ):
            self._send(identifier, pack(*values))

    def _remember(self, slot: int, targets: Sequence[int], phase: int) -> None:
        self._setpoint_of_cycle[slot] = targets
        self._phase_of_cycle[slot] = phase

    def hold(self, counts: Sequence[int], phase: Phase = Phase.STANDSTILL) -> None:
        """Hold these targets from the next cycle on."""
        self._held = list(counts)
        self._phase = phase
        self._trajectory = None

    def stop(self, phase: Phase = Phase.STOPPING) -> None:
        """Leave the trajectory and hold the last target, the cycles being marked as `phase`."""
        self._phase = phase
        self._trajectory = None

    def follow(self, trajectory: Trajectory) -> None:
        """Drive through a trajectory from the next cycle on; its end is held."""
        self._first_cycle = -1
        self.done = 0
        self._length = len(trajectory)
        planned = trajectory.phase == Phase.PLAN
        self._before_plan = int(planned.argmax()) if planned.any() else self._length
        self._trajectory = trajectory

    @property
    def at_end(self) -> bool:
        """Whether the trajectory has been sent to its end."""
        trajectory = self._trajectory
        return trajectory is not None and self.done >= len(trajectory)

    @property
    def began(self) -> int | None:
        """SYNC at which the first target of the last trajectory took effect; None before that is known."""
        return self._first_cycle + 1 if self._length and self._first_cycle >= 0 else None

    @property
    def before_plan(self) -> int:
        """Cycles of the last trajectory until its plan begins; all of them where it holds none."""
        return self._before_plan

    @property
    def length(self) -> int:
        """Cycles of the last trajectory, 0 before there is one."""
        return self._length

    def cut(self) -> None:
        """Send DISABLE VOLTAGE to every drive now, beside the rhythm of SYNC; it takes effect at the next one.

        Raises BusError when the bus refuses.
        """
        self._controlwords = [0] * len(self._receivers)
        for axis, (identifier, pack) in enumerate(self._receivers):
            self._send(identifier, pack(0, 0 if self._held is None else self._held[axis]))

    def command(self, controlwords: Sequence[int]) -> None:
        """The axes' controlwords from the next cycle on."""
        self._controlwords = list(controlwords)

    def told(self, cycles: NDArray[np.int64]) -> tuple[NDArray[np.int32], NDArray[np.uint8]]:
        """Setpoints (M, n) and phases (M,) that took effect in these cycles."""
        slots = cycles % _REMEMBERED
        return self._setpoint_of_cycle[slots], self._phase_of_cycle[slots]
