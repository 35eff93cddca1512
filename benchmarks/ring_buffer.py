"""Rows per second through the ring buffer to a reader in another process, beside a pipe of pickled rows.

    python benchmarks/ring_buffer.py [--seconds 2]

The row is the one of a six-axis rig. The writer writes blocks for the given time and waits where the reader, in
another process, is half a ring behind (as the acquisition process does in simulated time), so that no row is lost.
The peer sends the same blocks through a `multiprocessing.Pipe`.
"""

import argparse
import multiprocessing
import time
from multiprocessing.connection import Connection

import numpy as np

from daq.ring_buffer import RingOverrun, RingReader, RingWriter
from daq.samples import sample_dtype

_ROW = sample_dtype(6)
_CAPACITY = 1 << 16


def read_ring(name: str, ready: Connection) -> None:
    """Read until the writer has finished; send rows read, rows lost."""
    accepted = lost = 0
    with RingReader(name) as reader:
        ready.send("ready")
        while True:
            finished = reader.finished
            try:
                rows = reader.read()
            except RingOverrun as overrun:
                lost += overrun.lost
                continue
            reader.publish_position()
            accepted += len(rows)
            if finished and not len(rows):
                break
    ready.send((accepted, lost))


def read_pipe(pipe: Connection, ready: Connection) -> None:
    """Receive until None comes; send rows received."""
    accepted = 0
    ready.send("ready")
    while (rows := pipe.recv()) is not None:
        accepted += len(rows)
    ready.send((accepted, 0))


def through_ring(block: int, seconds: float) -> float:
    """Rows per second that arrived."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    rows = np.zeros(block, _ROW)
    with RingWriter(_ROW, _CAPACITY) as writer:
        process = context.Process(target=read_ring, args=(writer.name, theirs))
        process.start()
        ours.recv()
        writer.unlink()
        begun = time.perf_counter()
        while time.perf_counter() - begun < seconds:
            while writer.room < _CAPACITY // 2:
                time.sleep(0)
            for _ in range(16):
                writer.write(rows)
        writer.finish()
        accepted, lost = ours.recv()
        lasted = time.perf_counter() - begun
        process.join()
    assert lost == 0
    return accepted / lasted


def through_pipe(block: int, seconds: float) -> float:
    """Rows per second that arrived."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    sending, receiving = context.Pipe()
    rows = np.zeros(block, _ROW)
    process = context.Process(target=read_pipe, args=(receiving, theirs))
    process.start()
    ours.recv()
    begun = time.perf_counter()
    while time.perf_counter() - begun < seconds:
        sending.send(rows)
    sending.send(None)
    accepted, _ = ours.recv()
    lasted = time.perf_counter() - begun
    process.join()
    return accepted / lasted


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Rows per second to a reader in another process.")
    parser.add_argument("--seconds", type=float, default=2.0)
    seconds = parser.parse_args().seconds
    print(f"row of {_ROW.itemsize} bytes, ring of {_CAPACITY} rows")
    print(f"{'block':>6} {'ring, rows/s':>14} {'pipe, rows/s':>14} {'ratio':>7}")
    for block in (1, 16, 512):
        ring = through_ring(block, seconds)
        pipe = through_pipe(block, seconds)
        print(f"{block:6d} {ring:14,.0f} {pipe:14,.0f} {ring / pipe:7.1f}")


if __name__ == "__main__":
    main()
