"""What the acquisition process costs: the share of a core from frames to rings, paced by the clock.

    python benchmarks/acquisition_load.py [--seconds 5]

Two buses: six axes at 1 kHz (SYNC and six TPDOs a cycle: 7000 frames/s), and a 1 Mbit/s bus that is full of
8-byte frames (9009 frames/s: SYNC and eight TPDOs a millisecond). Frames come from memory when the clock says
that they are due, so what is measured is everything behind the receiver: alignment, decoding, limits, both
rings. The receiver's own share is in `receive_path.py`. The peer is the obvious way: a Python loop that takes
every frame as an object and collects rows in dictionaries, without any check of limits.
"""

import argparse
import struct
import time
from types import SimpleNamespace

import can
import numpy as np

from daq.rig import Axis, Joint, Rig, Robot
from daq.ring_buffer import RingWriter
from daq.samples import sample_dtype
from daq.sampling_loop import SamplingLoop
from drivers.frames import FRAME, OWN
from drivers.process_data import DriveStream, MappedEntry, ProcessData
from drivers.sync_producer import SyncStatistics

_CYCLE = 0.001


class DueFrames:
    """A receiver whose frames lie in memory and are handed out when they are due."""

    dropped = 0

    def __init__(self, frames: np.ndarray) -> None:
        self._frames = frames
        self._stamps = frames["stamp"].copy()
        self._next = 0
        self._begun: int | None = None

    def send(self, can_id: int, data: bytes) -> None:
        """The SYNCs are in memory already."""

    def read(self) -> np.ndarray:
        """Frames whose stamp has passed."""
        now = time.monotonic_ns()
        self._begun = now if self._begun is None else self._begun
        until = int(np.searchsorted(self._stamps, now - self._begun))
        block = self._frames[self._next : until]
        self._next = until
        return block

    @property
    def over(self) -> bool:
        """Whether all have been handed out."""
        return self._next >= len(self._frames)


def bus_of(axes: int, seconds: float) -> np.ndarray:
    """SYNC and one TPDO per axis in every cycle."""
    cycles = round(seconds / _CYCLE)
    block = np.zeros((cycles, axes + 1), FRAME)
    block["can_id"] = [0x80, *(0x181 + axis for axis in range(axes))]
    period = round(_CYCLE * 1e9)
    block["stamp"] = np.arange(cycles)[:, None] * period + np.arange(axes + 1) * period // (axes + 2)
    block["flags"][:, 0] = OWN  # the SYNCs are ours: an echo, not another master's
    block["length"][:, 1:] = 8
    position = np.rint(1e5 * np.sin(2 * np.pi * 0.2 * np.arange(cycles) * _CYCLE)).astype("<i4")
    block["data"][:, 1:, :4] = position.view("u1").reshape(cycles, 1, 4)
    block["data"][:, 1:, 6:8] = np.frombuffer(struct.pack("<H", 0x1237), "u1")
    return block.reshape(-1)


def rig_of(axes: int) -> Rig:
    """A rig with wide limits, so that nothing stops."""
    wide = {
        "position": (-100.0, 100.0),
        "velocity": 1e3,
        "acceleration": 1e6,
        "jerk": 1e9,
        "current": 1e3,
        "following_error": 100.0,
        "temperature": 100.0,
    }
    drive = {
        "drive": "generic-cia402",
        "encoder_counts": 65536,
        "gear_ratio": 50.0,
        "torque_constant": 0.2,
        "rated_torque": 1.0,
        "limits": wide,
    }
    names = [f"j{axis + 1}" for axis in range(axes)]
    return Rig(
        name="load",
        cycle=_CYCLE,
        robot=Robot(joints=tuple(Joint(name=name) for name in names)),
        axes=tuple(
            Axis.model_validate({"joint": name, "node": axis + 1, **drive}) for axis, name in enumerate(names)
        ),
    )


def stream_of(node: int) -> DriveStream:
    """Position, torque demand and statusword in one TPDO."""
    entries = (
        MappedEntry("position", 0x6064, 0, "<i4", 0),
        MappedEntry("command", 0x6074, 0, "<i2", 4),
        MappedEntry("statusword", 0x6041, 0, "<u2", 6),
    )
    commands = (
        MappedEntry("controlword", 0x6040, 0, "<u2", 0),
        MappedEntry("target", 0x607A, 0, "<i4", 2),
    )
    receive = ProcessData(0x200 + node, 1, commands)
    return DriveStream(node, (ProcessData(0x180 + node, 1, entries),), receive)


def measure_loop(axes: int, seconds: float) -> tuple[float, int]:
    """Share of a core of the sampling loop, and rows."""
    receiver = DueFrames(bus_of(axes, seconds))
    streams = [stream_of(axis + 1) for axis in range(axes)]
    with RingWriter(sample_dtype(axes), 1 << 16) as rows, RingWriter(FRAME, 1 << 18) as frames:
        rows.unlink()
        frames.unlink()
        loop = SamplingLoop(rig_of(axes), streams, receiver, rows, frames, lambda can_id: 0)
        loop._producer = SimpleNamespace(running=True, stop=lambda: None, statistics=SyncStatistics())
        used, begun = time.thread_time(), time.monotonic()
        while not receiver.over:
            loop.turn()
        share = (time.thread_time() - used) / (time.monotonic() - begun)
        if not rows.head:
            raise SystemExit("no rows came out of the loop: nothing was measured")
        return share, rows.head


def measure_peer(axes: int, seconds: float) -> float:
    """Share of a core for the same frames as `can.Message` objects, one by one."""
    receiver = DueFrames(bus_of(axes, seconds))
    rows: list[dict[int, tuple[int, ...]]] = []
    unpack = struct.Struct("<ihH").unpack
    used, begun = time.thread_time(), time.monotonic()
    while not receiver.over:
        time.sleep(0.001)
        block = receiver.read()
        columns = (block[name].tolist() for name in ("stamp", "can_id", "length"))
        for stamp, identifier, length, data in zip(*columns, block["data"], strict=True):
            message = can.Message(
                timestamp=stamp * 1e-9, arbitration_id=identifier, data=data[:length].tobytes(), check=False
            )
            if message.arbitration_id == 0x80:
                rows.append({})
            elif rows:
                rows[-1][message.arbitration_id] = unpack(message.data)
    return (time.thread_time() - used) / (time.monotonic() - begun)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Share of a core from frames to rings.")
    parser.add_argument("--seconds", type=float, default=5.0)
    seconds = parser.parse_args().seconds
    print(f"{'bus':34} {'frames/s':>9} {'sampling loop':>14} {'frame by frame':>15} {'ratio':>6}")
    for words, axes in (("six axes at 1 kHz", 6), ("1 Mbit/s full of 8-byte frames", 8)):
        ours, rows = measure_loop(axes, seconds)
        peer = measure_peer(axes, seconds)
        rate = (axes + 1) / _CYCLE
        print(f"{words:34} {rate:9.0f} {ours:14.1%} {peer:15.1%} {peer / ours:6.2f}   ({rows} rows)")


if __name__ == "__main__":
    main()
