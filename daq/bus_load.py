"""How much of a bus one cycle's frames take, before anything is sent: a bus at its limit delays and loses PDOs.

Lengths in bits of a classic CAN frame with 11-bit identifier, by ISO 11898-1: 47 bits and 8 for each byte of data, interframe
space included; and at most one stuff bit for each 4 bits of the 34 + 8n - 1 that are stuffed (R. I. Davis et al., Controller
Area Network schedulability analysis, Real-Time Systems 35, 2007, equation 1).
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass

from daq.rig import Rig
from drivers.bus import BusSettings
from drivers.process_data import DriveStream

_BESIDE = 0.1
"""share of a bus that heartbeats, SDO and retries want beside the process data; a choice, not a measurement"""


@dataclass(frozen=True)
class BusLoad:
    """What the process data of one cycle take.

    least, most : s, without stuff bits and with as many as there can be
    cycle       : s
    bit_rate    : bit/s
    """

    least: float
    most: float
    cycle: float
    bit_rate: int

    @property
    def ok(self) -> bool:
        """Whether the frames go into the cycle with what must go beside them, stuffed at worst."""
        return self.most <= (1 - _BESIDE) * self.cycle

    @property
    def words(self) -> str:
        """For an operator: the load, and what to change where it is too high."""
        load = (
            f"process data take {100 * self.least / self.cycle:.0f} to {100 * self.most / self.cycle:.0f} % of the bus at"
            f" {self.bit_rate / 1000:g} kbit/s and a cycle of {self.cycle:g} s"
        )
        if self.ok:
            return load
        least = self.most / (1 - _BESIDE)
        return (
            f"{load}: more than it carries beside heartbeats and SDO; make the cycle at least {least:.2g} s, raise the bit"
            " rate, or put the drives on two buses"
        )


def frame_bits(length: int) -> tuple[int, int]:
    """Bits of a frame with so many bytes of data: without stuff bits, and with as many as there can be."""
    plain = 47 + 8 * length
    return plain, plain + (34 + 8 * length - 1) // 4


def bus_load(rig: Rig, streams: Sequence[DriveStream], bit_rate: int) -> BusLoad:
    """The load of a rig's cycle: SYNC, and of every drive its TPDOs and its RPDO."""
    lengths = [0]
    for stream in streams:
        lengths += [pdo.length for pdo in (*stream.transmit, stream.receive)]
    least, most = (sum(each) for each in zip(*map(frame_bits, lengths), strict=True))
    return BusLoad(least / bit_rate, most / bit_rate, rig.cycle, bit_rate)


def bit_rate(bus: BusSettings) -> int | None:
    """bit/s at which a bus runs: as the kernel says for SocketCAN, else of the rig file; None where there is none."""
    if bus.interface in ("virtual", "udp_multicast"):
        return None
    if bus.interface != "socketcan":
        return bus.bitrate
    try:
        command = ["ip", "-json", "-details", "link", "show", "dev", bus.channel]
        output = subprocess.run(command, capture_output=True, text=True, timeout=2.0, check=True).stdout
        (link,) = json.loads(output)
        return int(link["linkinfo"]["info_data"]["bittiming"]["bitrate"])
    except (OSError, subprocess.SubprocessError, ValueError, KeyError, TypeError):
        return None  # vcan has no bit rate; without `ip` it is not known
