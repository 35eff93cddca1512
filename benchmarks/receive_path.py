"""How much of a core it takes to receive process data: our receive path beside canopen's PDO subscription.

    python benchmarks/receive_path.py [--seconds 5] [--json FILE]
    tests/with-vcan python benchmarks/receive_path.py

The same frames for both: TPDOs with position (int32), torque demand (int16) and statusword (uint16), all three
decoded. Drained: the frames wait in the socket, the time is that of reading and decoding. Paced: a process of
its own sends in the rhythm of a bus, and what counts is the processor time of the receiver. A 1 Mbit/s bus full
of frames with 8 bytes carries 9009 of them per second (111 bits each, without stuffing).

Over vcan0 where there is one. Without, over loopback datagrams that carry `struct can_frame`: the same system
calls, options and decoding on this machine's own kernel, only the socket's family differs. Inside user-mode Linux
vcan0 is real but a system call costs some twenty times more than on the machine itself, which counts against
whoever makes one per frame; a machine with CAN in its kernel lies near the figures of the loopback.
"""

import argparse
import json
import os
import platform
import select
import socket
import statistics
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import can
import canopen
import numpy as np
from can.interfaces.socketcan import SocketcanBus
from canopen.network import MessageListener
from canopen.pdo.base import PdoMap

from drivers.bus import check_network_interface, pass_ids
from drivers.errors import BusError
from drivers.frames import column
from drivers.receive_socketcan import SocketCanReceiver
from drivers.sync_producer import SYNC_ID, RealTime, SyncProducer

CHANNEL = "vcan0"
NAP = 0.005  # s, that of `daq/sampling_loop.py`, where it is explained
PORT = 47111  # of the loopback datagrams
AXES = 6
FULL_BUS = 9009  # frames/s
SIX_AXES = 1000 * (AXES + 1)  # six TPDOs and SYNC, every millisecond
BURST = 2000  # frames per drained round
ROUNDS = 20
_BUFFER = 8 * 1024 * 1024  # bytes, for both
_SO_RCVBUFFORCE = 33
_SO_TIMESTAMPNS = 35
_SO_RXQ_OVFL = 40
_FRAME = struct.Struct("<IB3x8s")
_TPDO = [0x181 + axis for axis in range(AXES)]


def has_vcan() -> bool:
    try:
        check_network_interface(CHANNEL)
    except BusError:
        return False
    return True


VCAN = has_vcan()


def loopback_socket() -> socket.socket:
    """Receives datagrams as a raw CAN socket receives frames: large buffer, kernel stamps, drop count."""
    datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    datagrams.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, _BUFFER)
    datagrams.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
    datagrams.bind(("127.0.0.1", PORT))
    return datagrams


class LoopbackBus(SocketcanBus):
    """python-can's SocketCAN bus on loopback datagrams: its own code from `recv` on."""

    def __init__(self) -> None:
        self.socket = loopback_socket()
        self.channel = self.channel_info = "loopback"
        self._is_filtered = True
        self._is_shutdown = False

    def shutdown(self) -> None:
        self._is_shutdown = True
        self.socket.close()


# ---- the two receivers; each has read(), which takes what waits and returns the number of frames ----


class Ours:
    """Raw socket, recvmmsg, NumPy decode by block."""

    name = f"coulomb, drained every {1e3 * NAP:g} ms"

    def __init__(self) -> None:
        self.receiver = SocketCanReceiver(CHANNEL, pass_ids([SYNC_ID, *_TPDO]))
        if VCAN:
            self.receiver.open()
        else:
            datagrams = loopback_socket()
            datagrams.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
            datagrams.setblocking(False)
            self.receiver._socket = datagrams

    def fileno(self) -> int:
        return self.receiver.fileno()

    def read(self) -> int:
        block = self.receiver.read()
        answers = block[block["can_id"] >= _TPDO[0]]
        self.axis = answers["can_id"] - _TPDO[0]
        self.values = tuple(column(answers, *where).copy() for where in ((0, "<i4"), (4, "<i2"), (6, "<u2")))
        return len(block)

    nap = NAP

    def paced(self, seconds: float) -> int:
        """The acquisition's rhythm: sleep, then take everything."""
        frames, end = 0, time.monotonic() + seconds
        while time.monotonic() < end:
            time.sleep(self.nap)
            frames += self.read()
        return frames

    def close(self) -> None:
        self.receiver.close()


class OursEachMillisecond(Ours):
    """The same, looked at five times as often: a limit would be seen 4 ms sooner."""

    name = "coulomb, drained each millisecond"
    nap = 0.001


class Canopen:
    """canopen's network on python-can, a callback per PDO that reads the three values."""

    name = "canopen: PDO callbacks, three .raw"

    def __init__(self) -> None:
        self.bus: SocketcanBus = (
            SocketcanBus(CHANNEL, can_filters=pass_ids([SYNC_ID, *_TPDO])) if VCAN else LoopbackBus()
        )
        self.bus.socket.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, _BUFFER)
        self.network = canopen.Network(self.bus)
        self.frames = 0
        for axis in range(AXES):
            node = self.network.add_node(axis + 1)
            pdo = node.tpdo[1]
            pdo.cob_id = _TPDO[axis]
            pdo.enabled = True
            pdo.clear()
            for index in (0x6064, 0x6074, 0x6041):
                pdo.add_variable(index)
            pdo.subscribe()
            pdo.add_callback(self._on_pdo)

    def _on_pdo(self, pdo: PdoMap) -> None:
        self.values = (pdo[0].raw, pdo[1].raw, pdo[2].raw)
        self.frames += 1

    def fileno(self) -> int:
        return self.bus.socket.fileno()

    def read(self) -> int:
        before = self.frames
        while (message := self.bus.recv(0)) is not None:
            self.network.notify(message.arbitration_id, message.data, message.timestamp)
        return self.frames - before

    def paced(self, seconds: float) -> int:
        """As canopen works: python-can's notifier thread wakes per frame."""
        notifier = can.Notifier(self.bus, [MessageListener(self.network)], 0.1)
        before = self.frames
        threading.Event().wait(seconds)
        received = self.frames - before
        notifier.stop(1.0)
        return received

    def close(self) -> None:
        self.bus.shutdown()


def real_time_priority() -> str:
    """Let nothing else on the machine come between; in words whether that was permitted."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
    except (PermissionError, AttributeError):
        return "normal priority: what else runs on this machine is in the figures"
    return "real-time priority (SCHED_FIFO)"


# ---- senders ----


def raw_socket() -> socket.socket:
    """Where a sender puts its frames."""
    if not VCAN:
        datagrams = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        datagrams.connect(("127.0.0.1", PORT))
        return datagrams
    raw = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    raw.bind((CHANNEL,))
    return raw


def send(raw: socket.socket, count: int) -> None:
    for number in range(count):
        raw.send(_FRAME.pack(_TPDO[number % AXES], 8, struct.pack("<ihH", number, number % 1000, 0x1237)))


def send_paced(rate: float, seconds: float) -> None:
    """Frame by frame in time, as on a bus; the process `--send` of the paced measurement.

    With a processor to spare it waits actively; on a single one it would take the receiver's time, and sends
    what is due each millisecond.
    """
    alone = (os.cpu_count() or 1) == 1
    with raw_socket() as raw:
        start, sent = time.monotonic(), 0
        while (elapsed := time.monotonic() - start) < seconds:
            due = int(elapsed * rate) - sent
            send(raw, due)
            sent += due
            if alone:
                time.sleep(0.001)


# ---- measurements ----


def drained(make: Callable[[], Ours | Canopen]) -> float:
    """Time per frame, µs: the median of rounds. Nothing is waited for, so time passed is time worked."""
    receiver = make()
    with raw_socket() as raw:
        times = []
        for _ in range(ROUNDS):
            send(raw, BURST)
            time.sleep(0.05)  # on a single processor the kernel delivers what it has queued
            began = time.perf_counter()
            frames = receiver.read()
            times.append((time.perf_counter() - began) / BURST)
            if frames != BURST:
                raise SystemExit(f"{receiver.name}: {frames} of {BURST} frames came")
    receiver.close()
    return statistics.median(times) * 1e6


def paced(make: Callable[[], Ours | Canopen], rate: float, seconds: float) -> tuple[float, float]:
    """(share of a core, frames per second received) at a given rate of frames."""
    receiver = make()
    sender = subprocess.Popen([sys.executable, __file__, "--send", str(rate), str(seconds + 6)])
    select.select([receiver], [], [], 30.0)  # until the sender has started
    cpu, wall = time.process_time(), time.monotonic()
    frames = receiver.paced(seconds)
    cpu, wall = time.process_time() - cpu, time.monotonic() - wall
    sender.terminate()
    sender.wait()
    receiver.close()
    return cpu / wall, frames / wall


def sync_periods(period: float, count: int, by_kernel: bool) -> np.ndarray:
    """Periods between SYNCs (s) as the kernel stamped them, from our thread or from the kernel's BCM."""
    receiver = SocketCanReceiver(CHANNEL, pass_ids([SYNC_ID]))
    receiver.open()
    if by_kernel:
        with can.Bus(interface="socketcan", channel=CHANNEL) as bus:
            task = bus.send_periodic(can.Message(arbitration_id=SYNC_ID, is_extended_id=False), period)
            time.sleep(count * period * 1.3)
            task.stop()
    else:
        SyncProducer(receiver.send, period, RealTime()).run(count)
    stamps = receiver.read()["stamp"].astype(float) * 1e-9
    receiver.close()
    return np.diff(stamps)


def table(title: str, header: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    widths = [max(len(row[position]) for row in [header, *rows]) for position in range(len(header))]
    print(f"\n{title}")
    for row in [header, *rows]:
        first, *others = (
            cell.ljust(width) if position == 0 else cell.rjust(width)
            for position, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        print("  ".join([first, *others]))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=5.0, help="length of each paced measurement")
    parser.add_argument("--json", type=Path, help="also write the figures to this file")
    parser.add_argument("--send", nargs=2, type=float, metavar=("RATE", "SECONDS"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    scheduling = real_time_priority()
    if arguments.send:
        send_paced(*arguments.send)
        return

    figures: dict[str, dict] = {}
    print(f"kernel {platform.release()}, {'vcan0' if VCAN else 'loopback datagrams'}, {scheduling}")
    ours, theirs = drained(Ours), drained(Canopen)
    figures["drained"] = {"coulomb_us": ours, "canopen_us": theirs, "ratio": theirs / ours}
    table(
        f"Drained ({BURST} frames at a time, all decoded)",
        ("receive path", "µs/frame", "frames/s per core", "full 1 Mbit/s bus", "ratio"),
        [
            (Ours.name, f"{ours:.2f}", f"{1e6 / ours:,.0f}", f"{ours * FULL_BUS / 1e4:.1f} %", "1.0"),
            (
                Canopen.name,
                f"{theirs:.2f}",
                f"{1e6 / theirs:,.0f}",
                f"{theirs * FULL_BUS / 1e4:.1f} %",
                f"{theirs / ours:.1f}",
            ),
        ],
    )
    for title, key, rate in (
        (f"Paced, full 1 Mbit/s bus ({FULL_BUS} frames/s)", "full_bus", FULL_BUS),
        (f"Paced, six axes at 1 kHz ({SIX_AXES} frames/s)", "six_axes", SIX_AXES),
    ):
        makers = (Ours, OursEachMillisecond, Canopen)
        results = [(make.name, *paced(make, rate, arguments.seconds)) for make in makers]
        base = results[0][1]
        figures[key] = {
            "coulomb_core": results[0][1],
            "coulomb_core_each_millisecond": results[1][1],
            "canopen_core": results[2][1],
            "ratio": results[2][1] / base,
            "coulomb_frames_per_second": results[0][2],
            "canopen_frames_per_second": results[2][2],
        }
        table(
            title,
            ("receive path", "share of a core", "frames/s received", "ratio"),
            [
                (name, f"{core * 100:.1f} %", f"{got:,.0f}", f"{core / base:.1f}")
                for name, core, got in results
            ],
        )
    if VCAN:
        figures["sync"] = sync_table()
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


def sync_table() -> dict[str, dict[str, float]]:
    """SYNC from our thread beside SYNC from the kernel, printed and returned."""
    rows, figures = [], {}
    for period in (0.001, 0.002, 0.004):
        for name, by_kernel in (("coulomb: thread, absolute deadlines", False), ("kernel: BCM", True)):
            periods = sync_periods(period, round(3 / period), by_kernel) * 1e3
            figures[f"{name} {period * 1e3:g} ms"] = {
                "mean_ms": float(periods.mean()),
                "std_ms": float(periods.std()),
                "p99_ms": float(np.percentile(periods, 99)),
            }
            rows.append(
                (
                    f"{name}, {period * 1e3:g} ms",
                    f"{periods.mean():.3f}",
                    f"{periods.std():.3f}",
                    f"{np.percentile(periods, 99):.3f}",
                )
            )
    table("SYNC period on vcan0 (kernel stamps, ms)", ("source", "mean", "standard deviation", "p99"), rows)
    return figures


if __name__ == "__main__":
    main()
