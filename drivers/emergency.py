"""EMCY objects and error codes in words.

Error codes by CiA 301 (EMCY, section 7.2.7) and CiA 402-2 (object 0x603F, error codes of drives).
"""

import struct
from dataclasses import dataclass

# Exact codes first; otherwise the class (upper byte), otherwise the upper nibble.
CODES = {
    0x0000: "no error",
    0x2220: "continuous over-current inside the drive",
    0x2250: "short circuit inside the drive",
    0x2310: "continuous over-current at the output",
    0x2320: "short circuit or earth leakage at the output",
    0x2340: "short circuit in the motor phases",
    0x3110: "mains over-voltage",
    0x3120: "mains under-voltage",
    0x3210: "DC link over-voltage",
    0x3220: "DC link under-voltage",
    0x3310: "output over-voltage",
    0x4210: "drive too hot",
    0x4220: "drive too cold",
    0x4310: "motor or transmission too hot",
    0x5112: "supply of the electronics too low",
    0x5400: "power section of the drive",
    0x5441: "contact on a drive enable input",
    0x6100: "internal software",
    0x6320: "parameter error",
    0x7121: "motor blocked",
    0x7122: "commutation",
    0x7300: "position sensor",
    0x7305: "incremental encoder 1",
    0x7306: "incremental encoder 2",
    0x7500: "communication",
    0x8110: "CAN overrun: objects were lost",
    0x8120: "CAN in error passive mode",
    0x8130: "heartbeat or life guarding of the master was lost",
    0x8140: "recovered from bus off",
    0x8150: "CAN-ID collision",
    0x8210: "PDO not processed: its length is wrong",
    0x8220: "PDO is longer than mapped",
    0x8240: "SYNC of unexpected length",
    0x8250: "RPDO time-out: no setpoint came",
    0x8500: "position control",
    0x8600: "positioning controller",
    0x8611: "following error is too large",
    0x8612: "position reference outside its limits",
    0x8700: "SYNC was lost",
    0x8A00: "torque control",
    0x9000: "external error",
    0xFF00: "manufacturer specific",
}

_CLASSES = {
    0x10: "generic error",
    0x20: "current",
    0x21: "current at the input",
    0x22: "current inside the drive",
    0x23: "current at the output",
    0x30: "voltage",
    0x31: "mains voltage",
    0x32: "voltage inside the drive",
    0x33: "output voltage",
    0x40: "temperature",
    0x41: "ambient temperature",
    0x42: "drive temperature",
    0x43: "motor or transmission temperature",
    0x44: "supply temperature",
    0x50: "drive hardware",
    0x51: "supply",
    0x52: "measuring circuits or computer",
    0x53: "operating unit",
    0x54: "power section",
    0x55: "data storage",
    0x60: "drive software",
    0x61: "internal software",
    0x62: "user software",
    0x63: "parameters",
    0x70: "additional module",
    0x71: "power electronics or motor",
    0x72: "measuring circuits",
    0x73: "sensor",
    0x74: "computation circuits",
    0x75: "communication module",
    0x80: "monitoring",
    0x81: "communication",
    0x82: "protocol",
    0x83: "torque control",
    0x84: "velocity control",
    0x85: "position control",
    0x86: "positioning",
    0x87: "synchronisation",
    0x88: "winding",
    0x89: "process data monitoring",
    0x8A: "control",
    0x90: "external error",
    0xF0: "additional function",
    0xFF: "manufacturer specific",
}

# Error register 0x1001, CiA 301 section 7.5.2.2.
_REGISTER_BITS = (
    "generic error",
    "current",
    "voltage",
    "temperature",
    "communication",
    "device profile specific",
    "reserved",
    "manufacturer specific",
)


def code_in_words(code: int) -> str:
    """An EMCY or 0x603F error code as an operator reads it, e.g. "0x8611 following error is too large"."""
    if code & 0xFF00 == 0 and code:
        return f"0x{code:04X} no error"
    meaning = CODES.get(code) or _CLASSES.get(code >> 8) or _CLASSES.get((code >> 8) & 0xF0)
    return f"0x{code:04X} {meaning or 'a code that no standard names'}"


def register_in_words(register: int) -> str:
    """The error register 0x1001 in words."""
    named = [meaning for bit, meaning in enumerate(_REGISTER_BITS) if register >> bit & 1]
    return ", ".join(named) or "no error"


@dataclass(frozen=True)
class Emergency:
    """One EMCY object.

    node      : who sent it
    code      : error code; 0x00xx means that the error has gone
    register  : error register 0x1001 at that time
    vendor    : up to five manufacturer specific bytes
    time      : s, of the frame
    """

    node: int
    code: int
    register: int
    vendor: bytes
    time: float

    @property
    def is_reset(self) -> bool:
        """Whether it reports that there is no error any more."""
        return self.code & 0xFF00 == 0

    def __str__(self) -> str:
        return f"node {self.node}: {code_in_words(self.code)} ({register_in_words(self.register)})"


def parse_emergency(node: int, data: bytes, time: float) -> Emergency:
    """An EMCY frame's data; short frames, which some drives send, are read as far as they go."""
    padded = bytes(data[:3]).ljust(3, b"\0")
    code, register = struct.unpack("<HB", padded)
    return Emergency(node, code, register, bytes(data[3:8]), time)
