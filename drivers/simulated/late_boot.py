"""NMT reset of a simulated drive that takes its time: without power at once, and deaf until its boot-up."""

import threading
from typing import Protocol

from drivers.simulated.faults import Faults
from drivers.simulated.simulated_drive import SimulatedDrive


class Booting(Protocol):
    """A simulated node, as far as it is reset."""

    drive: SimulatedDrive
    faults: Faults

    def boot(self) -> None:
        """Boot-up, then PRE-OPERATIONAL."""
        ...


def boot_after(seconds: float, node: Booting) -> None:
    """Let a node boot now, or so much later."""
    if not seconds:
        node.boot()
        return
    node.drive.start()
    node.faults.frozen = True

    def boot() -> None:
        node.faults.frozen = False
        node.boot()

    timer = threading.Timer(seconds, boot)
    timer.daemon = True
    timer.start()
