"""Simulated drives with a mechanism so simple that its motion is known in closed form."""

import itertools
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import numpy as np
import pytest

from drivers.bus import BusSettings
from drivers.canopen_network import CanopenNetwork
from drivers.cia402 import Mode
from drivers.drive import Drive, Timeouts
from drivers.frames import FrameBlock
from drivers.receive_python_can import PythonCanReceiver
from drivers.simulated.rig import SimulatedRig
from drivers.simulated.settings import ServoSettings, SimulatedAxis, SimulatedDrivesSettings
from drivers.sync_producer import AsAnswered, SimulatedClock, SyncProducer

TORQUE_CONSTANT = 0.2  # N m/A
INERTIA = 1e-3  # kg m²
PERIOD = 0.001  # s

_channels = itertools.count()


class Flywheels:
    """n shafts without friction or load: acceleration = K_t i / J."""

    def __init__(self, axes: int = 1):
        self.axes = axes
        self.reset(0)

    def reset(self, seed: int) -> None:
        self.motor_angle = np.zeros(self.axes)
        self.motor_velocity = np.zeros(self.axes)
        self.temperature = np.full(self.axes, 25.0)

    def step(self, motor_current: np.ndarray, duration: float) -> None:
        acceleration = TORQUE_CONSTANT / INERTIA * motor_current
        self.motor_angle = (
            self.motor_angle + self.motor_velocity * duration + 0.5 * acceleration * duration**2
        )
        self.motor_velocity = self.motor_velocity + acceleration * duration


def simulated_axis(node: int = 5, **changes) -> SimulatedAxis:
    """An axis whose servo suits the flywheel."""
    servo = ServoSettings(position_gain=40.0, velocity_gain=1.0, velocity_integral=10.0)
    return SimulatedAxis(node=node, **({"servo": servo} | changes))


class Bench:
    """A simulated rig on a virtual bus of its own, with the master's side of it."""

    def __init__(self, axes: tuple[SimulatedAxis, ...], **settings):
        self.bus = BusSettings(interface="virtual", channel=f"bench-{next(_channels)}")
        self.settings = SimulatedDrivesSettings(axes=axes, **settings)
        self.flywheels = Flywheels(len(axes))
        self.rig = SimulatedRig(self.settings, self.bus, self.flywheels)
        self.clock = SimulatedClock()
        self.blocks: list[FrameBlock] = []
        self._stack = ExitStack()

    def __enter__(self) -> "Bench":
        self._stack.enter_context(self.rig)
        self.network = self._stack.enter_context(CanopenNetwork(self.bus))
        self.receiver = PythonCanReceiver(self.bus)
        self.receiver.open()
        self._stack.callback(self.receiver.close)
        self.receiver.bus.use_clock(self.clock)
        timeouts = Timeouts(sdo=0.2, retries=1, transition=0.2, mode=0.1, nmt=1.0, quick_stop=3.0, homing=5.0)
        self.drives = [Drive(self.network, axis.node, timeouts=timeouts) for axis in self.settings.axes]
        return self

    def __exit__(self, *exception: object) -> None:
        self._stack.close()

    @property
    def drive(self) -> Drive:
        return self.drives[0]

    @property
    def node(self):
        return self.rig.nodes[0]

    def bring_up(self, mode: Mode = Mode.CYCLIC_SYNCHRONOUS_POSITION) -> None:
        """All drives mapped, OPERATIONAL and in OPERATION ENABLED."""
        self.streams = []
        for drive in self.drives:
            drive.produce_heartbeat(0.05)
            self.streams.append(drive.map_stream(mode))
            drive.set_cycle(PERIOD)
            drive.set_nmt_state("OPERATIONAL")
            drive.set_mode(mode)
            drive.enable()
        self.receiver.read()

    def run(
        self, cycles: int, target: Callable[[int], int] | None = None, controlword: int = 0x0F
    ) -> FrameBlock:
        """Run SYNC cycles; target(k) is the raw setpoint of every axis for SYNC k+1. All frames of the bus."""

        def send_setpoints(cycle: int) -> None:
            if target is not None:
                for stream in self.streams:
                    value = target(cycle)
                    self.receiver.send(stream.receive.can_id, stream.setpoint(controlword, value))

        SyncProducer(self.receiver.send, PERIOD, AsAnswered(advance=self.clock.advance), send_setpoints).run(
            cycles
        )
        return self.receiver.read()

    def values(self, frames: FrameBlock, name: str, axis: int = 0) -> np.ndarray:
        """A mapped value of all TPDOs among the frames, in their order."""
        pdo, entry = self.streams[axis].find(name)
        mine = frames[frames["can_id"] == pdo.can_id]
        start = entry.byte_offset
        size = np.dtype(entry.kind).itemsize
        return np.ascontiguousarray(mine["data"][:, start : start + size]).view(entry.kind)[:, 0]


@pytest.fixture
def open_bench() -> Iterator[Callable[..., Bench]]:
    """Opens benches: open_bench(axis, …, sync_timeout=…)."""
    with ExitStack() as stack:

        def open_one(*axes: SimulatedAxis, **settings) -> Bench:
            return stack.enter_context(Bench(axes or (simulated_axis(),), **settings))

        yield open_one


@pytest.fixture
def axis() -> Callable[..., SimulatedAxis]:
    """Makes simulated axes: axis(node, **changes)."""
    return simulated_axis
