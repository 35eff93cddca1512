"""A weighing scale on a serial port, MT-SICS protocol: the payload's mass is weighed, not typed.

Commands of MT-SICS level 0: `S` (weight, when stable), `Z` (zero). Answers, each one line:

    S S     3.4584 kg     stable weight         S D     3.4571 kg    unstable (dynamic) weight
    S I                   busy, or no stable weight in time          Z A    zeroed
    S +                   overload              S -     underload    Z I Z + Z -   not zeroed
    ES  not understood    ET  transmission error    EL  not allowed now

Source: Mettler-Toledo, MT-SICS Reference Manual, level 0 commands and error messages.
"""

import time
from dataclasses import dataclass

import serial

from drivers.errors import ScaleError

# What a port that goes away raises; on POSIX pyserial lets the terminal's own error through.
try:
    from termios import error as _terminal_error
except ImportError:  # not on POSIX
    _terminal_error = OSError
_BROKEN: tuple[type[Exception], ...] = (serial.SerialException, OSError, _terminal_error)

# kg per unit, as MT-SICS abbreviates them.
KILOGRAMS = {
    "g": 1e-3,
    "kg": 1.0,
    "mg": 1e-6,
    "ug": 1e-9,
    "µg": 1e-9,
    "t": 1e3,
    "lb": 0.45359237,
    "oz": 0.028349523125,
}

_ERRORS = {
    "ES": "it does not understand the command; does it speak MT-SICS?",
    "ET": "it received the command garbled; check cable, baud rate and parity",
    "EL": "it cannot carry out the command now",
}


@dataclass(frozen=True)
class Weight:
    """A weight from the scale.

    mass   : kg
    stable : False when the scale had not come to rest
    text   : the answer as it came, for the record
    """

    mass: float
    stable: bool
    text: str


class Scale:
    """A scale on a serial port; a context manager.

    port     : e.g. /dev/ttyUSB0
    baudrate : bit/s, as set at the scale
    timeout  : s to wait for an answer; a stable weight may take as long as the scale needs to come to rest

    Raises ScaleError when the port cannot be opened.
    """

    def __init__(self, port: str, baudrate: int = 9600, timeout: float = 10.0):
        self.port = port
        self.timeout = timeout
        try:
            self._serial = serial.Serial(port, baudrate=baudrate, timeout=0.05, write_timeout=timeout)
        except (*_BROKEN, ValueError) as error:
            raise ScaleError(f"scale at {port}: the port cannot be opened: {error}") from error

    def __enter__(self) -> "Scale":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the port; harmless when repeated."""
        self._serial.close()

    def weigh(self) -> Weight:
        """The weight once it is stable (`S`).

        Raises ScaleError when no stable weight comes, on overload and underload, and when the scale does not
        answer or answers with an error.
        """
        weight = self._weight(self._ask("S"))
        if not weight.stable:
            raise ScaleError(
                f"scale at {self.port}: an unstable weight came where a stable one was asked for"
            )
        return weight

    def zero(self) -> None:
        """Set the scale to zero (`Z`).

        Raises ScaleError when the load is outside the zero-setting range or does not come to rest.
        """
        answer = self._ask("Z").split()
        status = answer[1] if len(answer) > 1 and answer[0] == "Z" else ""
        if status == "A":
            return
        reasons = {
            "I": "it is busy, or the load does not come to rest",
            "+": "the load is above the zero-setting range",
            "-": "the load is below the zero-setting range",
        }
        raise ScaleError(
            f"scale at {self.port}: not zeroed: {reasons.get(status, f'it answered {answer!r}')}"
        )

    def _ask(self, command: str) -> str:
        try:
            # A late answer to an earlier question must not be taken for the answer to this one.
            self._serial.reset_input_buffer()
            self._serial.write(command.encode("ascii") + b"\r\n")
            line = self._read_line()
        except _BROKEN as error:
            raise ScaleError(f"scale at {self.port}: the connection broke: {error}") from error
        if line in _ERRORS:
            raise ScaleError(f"scale at {self.port}: {_ERRORS[line]} (answer {line})")
        return line

    def _read_line(self) -> str:
        end = time.monotonic() + self.timeout
        received = bytearray()
        while not received.endswith(b"\n"):
            received += self._serial.read_until(b"\n")
            if time.monotonic() > end and not received.endswith(b"\n"):
                came = f"; only {bytes(received)!r} came" if received else ""
                raise ScaleError(f"scale at {self.port}: no answer within {self.timeout:g} s{came}")
        return received.decode("latin-1").strip()

    def _weight(self, line: str) -> Weight:
        parts = line.split()
        status = parts[1] if len(parts) > 1 and parts[0] == "S" else ""
        reasons = {
            "I": "busy, or no stable weight in time: wait until the load is at rest",
            "+": "overload: the load is too heavy for it",
            "-": "underload: is the pan in place?",
        }
        if status in reasons and len(parts) == 2:
            raise ScaleError(f"scale at {self.port}: {reasons[status]}")
        if status not in ("S", "D") or len(parts) != 4:
            raise ScaleError(f"scale at {self.port}: the answer {line!r} is not a weight of MT-SICS")
        unit = parts[3]
        if unit not in KILOGRAMS:
            raise ScaleError(f"scale at {self.port}: it weighs in {unit!r}; set it to g or kg")
        try:
            mass = float(parts[2]) * KILOGRAMS[unit]
        except ValueError as error:
            raise ScaleError(f"scale at {self.port}: {parts[2]!r} is not a number") from error
        return Weight(mass=mass, stable=status == "S", text=line)
