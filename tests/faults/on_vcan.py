"""Faults of the matrix over the kernel's CAN: a whole session, the simulated drive in a process of its own, and the drive asked
afterwards how it stands. Run where there is a vcan0: `tests/with-vcan .venv/bin/python -m tests.faults --part vcan`.
"""

import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import yaml

from daq.excitation.excitation_plan import ExcitationPlan
from daq.excitation.trapezoid import Move
from daq.rig import Rig
from daq.session_events import SessionState, StepOutOfTurn
from daq.session_workflow import PayloadSession
from drivers.canopen_network import CanopenNetwork
from drivers.cia402 import State
from drivers.drive import Drive
from drivers.errors import DriverError
from tests.faults.matrix import FAULTS, Fault

MOVES = (
    Move(to=(0.5,), duration=1.5, ramp=0.3),
    Move(to=(1.2,), duration=1.6, ramp=0.5),
    Move(to=(0.5,), duration=1.6, ramp=0.5),
)
VCAN_PHASES = ("slow", "fast")
INTERFACE, NODE = "vcan0", 5
PATIENCE = 120.0
"""s of the wall clock until a session must have ended; a simulated kernel takes its time"""
STILL = 1e-3
"""rad that a joint at rest may have moved between two questions, a load on a brake included"""
BEYOND = 0.3
"""rad that it may have gone on after its last sample"""
OFF = (State.FAULT, State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON, State.NOT_READY_TO_SWITCH_ON)
_NAMES = (
    "EMCY 0x4310",
    "feedback flips its sign",
    "drive runs away",
    "drive runs away, ignores controlwords",
    "node freezes",
    "node in NMT STOPPED",
    "node boots anew",
    "all TPDOs lost",
    "one SYNC of another master",
    "setpoints of another master",
    "NMT reset of another master",
)
VCAN_FAULTS = tuple(fault for fault in FAULTS if fault.name in _NAMES)


@dataclass(frozen=True)
class VcanCell:
    """What became of one fault in one phase."""

    fault: str
    phase: str
    words: str
    failures: tuple[str, ...]


def vcan_cells(only: str, kept: set[tuple[str, str]]) -> Iterator[VcanCell]:
    """Drive the cells whose fault's name holds `only` and that are not kept.

    Raises SystemExit where there is no vcan0.
    """
    if not Path(f"/sys/class/net/{INTERFACE}").exists():
        raise SystemExit(f"{INTERFACE}: is not here; run this by tests/with-vcan")
    for fault in VCAN_FAULTS:
        for phase in VCAN_PHASES:
            if only in fault.name and (fault.name, phase) not in kept:
                with tempfile.TemporaryDirectory() as folder:
                    try:
                        yield _cell(fault, phase, Path(folder))
                    except StepOutOfTurn as error:
                        yield _failed(fault, phase, str(error))


def _cell(fault: Fault, phase: str, folder: Path) -> VcanCell:
    file = folder / "rig.yaml"
    file.write_text(yaml.safe_dump(_settings(fault, phase)), encoding="utf-8")
    rig = Rig.load(file)
    with _drive(file):
        with PayloadSession(rig, folder / "experiment", _plan(), rig.payload("none"), "operator") as session:
            check = session.check()
            if not check.ok:
                return _failed(fault, phase, f"the rig was not ready: {session.reason} {check.problems}")
            session.confirm_payload(0.0)
            session.arm()
            session.start()
            state = session.wait(PATIENCE)
            recording = session.file
        told = "emergency stop" in f"{session.alarm} {session.reason}"
        failures = []
        if state is not SessionState.FAULTED or not session.reason:
            failures.append(f"the session is {state.value}: {session.reason}")
        powered, still, beyond = _as_it_stands(rig, recording)
    if not told and (powered or not still):
        failures.append("power" if powered else "not at rest" + ", and nobody was told")
    if not told and beyond > BEYOND:
        failures.append(f"{beyond:.2f} rad beyond the last sample")
    if failures:
        return _failed(fault, phase, *failures)
    ending = "told: emergency stop" if told else f"off, at rest {beyond:.2f} rad beyond the last sample"
    cut = "cut; " if "power was cut" in session.reason else ""
    return VcanCell(fault.name, phase, f"faulted; {cut}{ending}", ())


def _plan() -> ExcitationPlan:
    """A slow move up, and a fast one there and back."""
    return ExcitationPlan(joints=("j3",), start=(0.35,), phases=MOVES)


def _failed(fault: Fault, phase: str, *failures: str) -> VcanCell:
    return VcanCell(fault.name, phase, f"**fails**: {'; '.join(failures)}", failures)


def _settings(fault: Fault, phase: str) -> dict:
    """The rig file of RX130L joint 3 on vcan, with the patience that a simulated kernel needs."""
    settings = Rig.load("rx130l-joint3-simulated").model_dump(mode="json", exclude_none=True)
    planned = [
        {"fault": name, "value": value, "phase": phase, "speed": 50.0, "after": 3}
        for name, value in fault.parts
    ]
    settings |= {
        "name": f"faults-{os.getpid()}",
        "bus": {"interface": "socketcan", "channel": INTERFACE},
        "cycle": 0.005,
    }
    settings["axes"][0]["node"] = NODE
    settings["supervision"] |= {"silence": 0.3, "heartbeat_timeout": 1.0, "parent_timeout": 10.0}
    settings["simulated"]["sync_timeout"] = 5.0
    settings["simulated"]["drives"][0] |= {"brake": True, "faults": {"planned": planned}}
    return settings


@contextmanager
def _drive(file: Path) -> Iterator[None]:
    """The drive on the bus, in a process of its own."""
    process = subprocess.Popen(
        [sys.executable, "-m", "api", "fake-drive", str(file), "--payload", "none"],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )
    try:
        assert process.stdout is not None
        assert "fake-drive: nodes " in process.stdout.readline()
        yield
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(20)


def _as_it_stands(rig: Rig, recording: Path | None) -> tuple[bool, bool, float]:
    """Whether the drive has power, whether it stands still (says the drive; as if it did neither where it does not answer), and
    the way from the last sample to where it is, rad; 0 where the fault came on the way to the plan's start, without samples."""
    scale = abs(float(rig.position_matrix[0, 0]))
    positions, valid = np.zeros(0), np.zeros(0, bool)
    if recording is not None:
        with h5py.File(recording) as file:
            positions, valid = file["position"][:, 0], file["valid"][:, 0] & 1 == 1
    try:
        with CanopenNetwork(rig.bus) as network:
            drive = Drive(network, NODE, rig.profiles[0])
            state = drive.state()
            seen = []
            for _ in range(20):
                seen.append(drive.position())
                threading.Event().wait(0.02)
    except DriverError:
        return True, False, np.inf
    beyond = abs(float(seen[-1]) - float(positions[valid][-1])) * scale if valid.any() else 0.0
    return state not in OFF, float(np.ptp(seen)) * scale < STILL, beyond
