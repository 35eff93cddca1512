"""A simulated weighing scale on a pseudo-terminal, the twin of `drivers/scale.py`."""

import os
import pty
import select
import threading
import tty

from drivers.scale import KILOGRAMS

_ZERO_RANGE = 0.02  # of the capacity, the usual zero-setting range


class SimulatedScale:
    """An MT-SICS scale; a context manager. `port` is the serial port to open.

    capacity   : kg, beyond which it shows overload
    unit       : in which it shows weights
    resolution : kg, of what it shows

    `load` (kg) may be changed while it runs; `at_rest` = False lets it show unstable weights; `answer`
    overrides every answer by a fixed text, `silent` keeps it from answering.
    """

    def __init__(self, load: float = 0.0, capacity: float = 12.0, unit: str = "kg", resolution: float = 1e-4):
        self.load = load
        self.capacity = capacity
        self.unit = unit
        self.resolution = resolution
        self.at_rest = True
        self.silent = False
        self.answer: str | None = None
        self._zero = 0.0
        self._controller, self._terminal = pty.openpty()
        tty.setraw(self._terminal)
        self.port = os.ttyname(self._terminal)
        self._end, self._ended = os.pipe()
        self._thread = threading.Thread(target=self._serve, name="simulated-scale", daemon=True)

    def __enter__(self) -> "SimulatedScale":
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Unplug it; harmless when repeated."""
        if not self._thread.is_alive():
            return
        os.write(self._ended, b".")
        self._thread.join()
        for descriptor in (self._terminal, self._controller, self._end, self._ended):
            os.close(descriptor)

    def _serve(self) -> None:
        received = b""
        while True:
            ready, _, _ = select.select([self._controller, self._end], [], [])
            if self._end in ready:
                return
            received += os.read(self._controller, 64)
            while b"\r\n" in received:
                command, received = received.split(b"\r\n", 1)
                answer = self._reply(command.decode("ascii", "replace"))
                if not self.silent:
                    os.write(self._controller, answer.encode("latin-1") + b"\r\n")

    def _reply(self, command: str) -> str:
        if self.answer is not None:
            return self.answer
        if command == "Z":
            return self._set_zero()
        if command not in ("S", "SI"):
            return "ES"
        shown = self.load - self._zero
        if shown > self.capacity:
            return "S +"
        if shown < -_ZERO_RANGE * self.capacity:
            return "S -"
        if not self.at_rest and command == "S":
            return "S I"
        steps = round(shown / self.resolution)
        value = f"{steps * self.resolution / KILOGRAMS[self.unit]:10.6g}"
        return f"S {'S' if self.at_rest else 'D'} {value} {self.unit}"

    def _set_zero(self) -> str:
        if not self.at_rest:
            return "Z I"
        limit = _ZERO_RANGE * self.capacity
        if self.load > limit:
            return "Z +"
        if self.load < -limit:
            return "Z -"
        self._zero = self.load
        return "Z A"
