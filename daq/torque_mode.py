"""Cyclic torque mode around one plan: who holds the axes, and the change from one to the other, at rest."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.rig import Rig
from daq.rig_drives import RigDrives
from daq.torque_offset import per_mille
from daq.torque_stream import TorqueSetpoints
from drivers.cia402 import Mode


class TorqueMode:
    """Takes the axes of a rig over from its drives' loops, and hands them back.

    Between `begin` and `take_over` the loop here runs beside the drives' own, at rest, where both ask for the same torque.
    """

    def __init__(self, rig: Rig, drives: RigDrives, setpoints: TorqueSetpoints) -> None:
        self._drives, self._setpoints = drives, setpoints
        self._per_mille = per_mille(rig)
        self._ampere = rig.command_scale
        self.holds = False
        """whether the axes are held by our loop"""

    def begin(self, command: NDArray[Any]) -> None:
        """Let the loop run from the drives' present current references (n,), raw."""
        self._setpoints.engage(np.asarray(command * self._ampere * self._per_mille).tolist())

    def take_over(self) -> None:
        """Mode 10, confirmed by every drive. Raises DriverError."""
        self._drives.set_mode(Mode.CYCLIC_SYNCHRONOUS_TORQUE)
        self.holds = True

    def hand_back(self) -> None:
        """The axes' own mode, confirmed by every drive, without the watch that torque mode needs. Raises DriverError."""
        self._drives.set_mode(None)
        self.holds = False
        self._setpoints.release()
        self._drives.end_setpoint_watch()
