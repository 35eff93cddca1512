"""How much of a bus one cycle's frames take, before anything is sent: a bus at its limit delays and loses PDOs.

Lengths in bits of a classic CAN frame with 11-bit identifier, by ISO 11898-1: 47 bits and 8 for each byte of data, interframe
space included; and at most one stuff bit for each 4 bits of the 34 + 8n - 1 that are stuffed (R. I. Davis et al., Controller
Area Network schedulability analysis, Real-Time Systems 35, 2007, equation 1).
"""

from __future__ import annotations

import json
import subprocess
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import can

from daq.rig import Rig
from drivers.bus import BusSettings
from drivers.process_data import DriveStream

_WORTH_A_WORD = 0.01
"""share of a bus from which on others' frames are named; heartbeats of a few nodes take less"""
_BESIDE = 0.1
"""share of a bus that heartbeats, SDO and retries want beside the process data; a choice, not a measurement"""


@dataclass(frozen=True)
class OtherTraffic:
    """What nodes that are none of the rig's sent while the rig's were silent.

    bits    : stuffed at worst
    seconds : for so long they were listened to
    busiest : ids that take most of the bus, at most three, the busiest first
    """

    bits: int = 0
    seconds: float = 1.0
    busiest: tuple[int, ...] = ()

    @classmethod
    def of(cls, messages: Iterable[can.Message], seconds: float, nodes: Sequence[int]) -> OtherTraffic:
        """Of all frames that were heard in so many seconds; those of the rig's own nodes are not counted."""
        bits: Counter[int] = Counter()
        for message in messages:
            identifier = message.arbitration_id
            if message.is_extended_id or identifier & 0x7F not in nodes:
                length = 0 if message.is_remote_frame else len(message.data)
                bits[identifier] += frame_bits(length, extended=message.is_extended_id)[1]
        return cls(bits.total(), seconds, tuple(identifier for identifier, _ in bits.most_common(3)))


@dataclass(frozen=True)
class BusLoad:
    """What the process data of one cycle take, and what others do.

    least, most : s, without stuff bits and with as many as there can be
    cycle       : s
    bit_rate    : bit/s
    others      : what was heard before anything was sent
    """

    least: float
    most: float
    cycle: float
    bit_rate: int
    others: OtherTraffic = OtherTraffic()

    @property
    def of_others(self) -> float:
        """Share of the bus that other nodes take."""
        return self.others.bits / self.bit_rate / self.others.seconds

    @property
    def ok(self) -> bool:
        """Whether the frames go into the cycle with what must go beside them, stuffed at worst."""
        return self.most <= (1 - max(_BESIDE, self.of_others)) * self.cycle

    @property
    def words(self) -> str:
        """For an operator: the load, and what to change where it is too high."""
        load = (
            f"process data take {100 * self.least / self.cycle:.0f} to {100 * self.most / self.cycle:.0f} % of the bus at"
            f" {self.bit_rate / 1000:g} kbit/s and a cycle of {self.cycle:g} s"
        )
        if self.of_others >= _WORTH_A_WORD:
            ids = ", ".join(f"0x{each:03X}" for each in self.others.busiest)
            load += f"; other nodes' frames ({ids}) take {100 * self.of_others:.0f} %"
        if self.ok:
            return load
        if self.of_others > _BESIDE:
            return f"{load}: together more than it carries; take those nodes off this bus, or have them send less often"
        least = self.most / (1 - _BESIDE)
        return (
            f"{load}: more than it carries beside heartbeats and SDO; make the cycle at least {least:.2g} s, raise the bit"
            " rate, or put the drives on two buses"
        )


def frame_bits(length: int, *, extended: bool = False) -> tuple[int, int]:
    """Bits of a frame with so many bytes of data: without stuff bits, and with as many as there can be.

    extended : an identifier of 29 bits, which takes 20 bits more, stuffed like those of 11
    """
    more = 20 if extended else 0
    plain = 47 + more + 8 * length
    return plain, plain + (34 + more + 8 * length - 1) // 4


def bus_load(
    rig: Rig, streams: Sequence[DriveStream], bit_rate: int, others: OtherTraffic = OtherTraffic()
) -> BusLoad:
    """The load of a rig's cycle: SYNC, and of every drive its TPDOs and its RPDO; and of others what was heard."""
    lengths = [0]
    for stream in streams:
        lengths += [pdo.length for pdo in (*stream.transmit, stream.receive)]
    least, most = (sum(each) for each in zip(*map(frame_bits, lengths), strict=True))
    return BusLoad(least / bit_rate, most / bit_rate, rig.cycle, bit_rate, others)


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
