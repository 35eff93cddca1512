"""The simulated rig: one node per axis on one bus, and the mechanism behind all of them.

Time passes with SYNC. At SYNC k every drive samples and answers; then the setpoints received since SYNC k-1
become effective, and servo loops and mechanism run until the instant of SYNC k+1. The servo acts in the
middle of its periods, so that the current which a drive reports at SYNC has acted as long before it as it
will after: sampling adds no delay of its own to what is identified.

Without power an axis coasts until its brake closes, and without a brake it falls. Without SYNC the mechanism goes on in
wall-clock time, where that is the rig's time: the drives follow the slope of their last setpoints until they miss SYNC.
Where time is simulated it passes with SYNC alone, unless a drive has to bring the mechanism to rest by itself (lost SYNC,
lost master, fault, quick stop), homes, or has lost power in motion: then the wall clock drives it.

How long SYNC or master have been silent is told by a clock that stands while this whole process is held up: a
real drive has a processor of its own, and one that did not run has not been listening either.
"""

import logging
import threading
import time

import canopen
import numpy as np

from drivers.bus import BusSettings
from drivers.cia402 import Mode
from drivers.simulated import process_image as slot
from drivers.simulated.link import Link, open_link
from drivers.simulated.mechanism import Mechanism
from drivers.simulated.node import SimulatedNode
from drivers.simulated.settings import SimulatedDrivesSettings
from drivers.sync_producer import SYNC_ID

logger = logging.getLogger(__name__)

_SYNC_LOST = 0x8700
_MASTER_LOST = 0x8130
_HOUSEKEEPING = 0.005  # s between two looks at heartbeats and time-outs
_FREE_RUN_LIMIT = 0.02  # s of mechanism per look, when the wall clock has run away
_LONGEST_LOOK = 0.1  # s that one look adds to the drives' own clock


class _Wire(canopen.Network):
    """canopen's network object without a bus: its frames go out by the rig's link."""

    def __init__(self, link: Link):
        super().__init__()
        self._link = link

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self._link.send(can_id, bytes(data))


class SimulatedRig:
    """Simulated drives on a bus; a context manager.

    settings  : the drives, in the order of the mechanism's motors
    bus       : where they are to be found
    mechanism : what they move

    Raises BusError when the bus cannot be opened, ValueError when drives and motors do not match.
    """

    def __init__(self, settings: SimulatedDrivesSettings, bus: BusSettings, mechanism: Mechanism):
        if mechanism.axes != len(settings.axes):
            raise ValueError(
                f"{len(settings.axes)} drives cannot move a mechanism with {mechanism.axes} motors"
            )
        self.settings = settings
        self.mechanism = mechanism
        self.time = 0.0  # s of the mechanism
        self._link = open_link(bus)
        self._wire = _Wire(self._link)
        self._lock = threading.RLock()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._awake = 0.0  # s, the drives' own clock
        self._last_sync: float | None = None  # s, likewise
        self._since_sync = 0.0  # s of the mechanism
        self._heartbeat_due: dict[int, float] = {}
        self._masters_heard: dict[int, float] = {}
        self._current = np.zeros(mechanism.axes)
        self.nodes = tuple(
            SimulatedNode(axis, settings.seed * 1000 + axis.node, self._link.send) for axis in settings.axes
        )
        self._node_of_rpdo: dict[int, SimulatedNode] = {}
        self._node_of_sdo = {0x600 + node.node: node for node in self.nodes}
        for node in self.nodes:
            node.associate_network(self._wire)
            node.on_pdos_changed = self._map_rpdos
        mechanism.reset(settings.seed)

    def start(self) -> None:
        """Power on: every node boots and serves from now on."""
        self._sample()
        self._map_rpdos()
        for node in self.nodes:
            node.boot()
        self._link.start(self._on_frame, self._on_remote_frame)
        self._thread = threading.Thread(target=self._keep_house, name="simulated-rig", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Power off; harmless when repeated."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join(2.0)
            self._thread = None
        self._link.close()

    def __enter__(self) -> "SimulatedRig":
        self.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    # ---- frames ----

    def _map_rpdos(self) -> None:
        self._node_of_rpdo = {can_id: node for node in self.nodes for can_id in node.receive_ids}

    def _on_frame(self, can_id: int, data: bytes) -> None:
        if can_id == SYNC_ID:
            with self._lock:
                self._on_sync()
                self._hear_foreign_syncs()
            return
        node = self._node_of_rpdo.get(can_id)
        if node is not None:
            with self._lock:
                node.take_rpdo(can_id, data)
            return
        node = self._node_of_sdo.get(can_id)
        if node is not None:
            if node.axis.oddities.answers_after:
                threading.Timer(node.axis.oddities.answers_after, self._take_sdo, (node, data)).start()
            else:
                self._take_sdo(node, data)
        elif can_id == 0 and len(data) >= 2:
            with self._lock:
                for each in self.nodes:
                    each.take_nmt(data[0], data[1])
        elif can_id >> 7 == 0xE:  # 0x700 + node: somebody's heartbeat
            self._masters_heard[can_id & 0x7F] = self._awake

    def _take_sdo(self, node: SimulatedNode, data: bytes) -> None:
        with self._lock:
            if not self._closing.is_set():
                node.take_sdo(data)

    def _on_remote_frame(self, can_id: int) -> None:
        """Node guarding: somebody asks a node for its state."""
        node = self._node_of_sdo.get(can_id - 0x100)  # 0x700 + node, as 0x600 + node
        if node is not None:
            with self._lock:
                node.guarding.answer(self._awake)

    def _hear_foreign_syncs(self) -> None:
        """SYNCs of another master, as a node's faults say: all drives act on them as on ours."""
        for node in self.nodes:
            if node.faults.foreign_syncs:
                node.faults.foreign_syncs -= 1
                self._link.send(SYNC_ID, b"")
                self._on_sync()

    def _sample(self) -> None:
        angles = self.mechanism.motor_angle
        temperatures = self.mechanism.temperature
        for position, node in enumerate(self.nodes):
            node.drive.sample(float(angles[position]), float(temperatures[position]))

    def _on_sync(self) -> None:
        self._last_sync = self._awake
        nodes = self.nodes
        angles = self.mechanism.motor_angle.tolist()
        temperatures = self.mechanism.temperature.tolist()
        for node, angle, temperature in zip(nodes, angles, temperatures, strict=True):
            node.answer_sync(angle, temperature)
        period = nodes[0].period
        for node in nodes:
            node.activate_setpoints(period)
        self._since_sync = 0.0
        self._pass_time(period)

    # ---- time ----

    def _pass_time(self, duration: float) -> None:
        """Let servos and mechanism run for `duration` s; nothing moves while every axis is held by its brake."""
        nodes = self.nodes
        if not any(node.drive.machine.powered or node.drive.free for node in nodes):
            return
        mechanism, current = self.mechanism, self._current
        steps = max(1, round(duration / self.settings.servo_period))
        step = duration / steps
        half = 0.5 * step
        for number in range(steps):
            # Between the servo's acts the current does not change: half a period on either side is one.
            mechanism.step(current, step if number else half)
            since_sync = self._since_sync + (number + 0.5) * step
            angles = mechanism.motor_angle
            for position, node in enumerate(nodes):
                current[position] = node.drive.servo_step(float(angles[position]), since_sync, step)
        mechanism.step(current, half)
        self._since_sync += duration
        self.time += duration

    def _keep_house(self) -> None:
        """Heartbeats, and what the drives do on their own when SYNC or master fall silent."""
        last = time.monotonic()
        while not self._closing.wait(_HOUSEKEEPING):
            now = time.monotonic()
            with self._lock:
                try:
                    self._awake += min(now - last, _LONGEST_LOOK)
                    self._heartbeats(now)
                    self._watch_master()
                    self._watch_sync(min(now - last, _FREE_RUN_LIMIT))
                except Exception:
                    logger.exception("the simulated rig stumbled")
                    raise
            last = now

    def _heartbeats(self, now: float) -> None:
        for node in self.nodes:
            if not node.heartbeat_period:
                self._heartbeat_due.pop(node.node, None)
                continue
            due = self._heartbeat_due.get(node.node)
            if due is None or now >= due:
                node.send_heartbeat()
                self._heartbeat_due[node.node] = max(now, due or now) + node.heartbeat_period

    def _watch_master(self) -> None:
        for node in self.nodes:
            if not node.drive.machine.powered:
                continue
            master, timeout = node.master_heartbeat or (0, 0.0)
            heard = self._masters_heard.get(master)
            lost = heard is not None and self._awake - heard > timeout
            if (master and lost) or node.guarding.master_lost(self._awake):
                node.drive.fail(_MASTER_LOST)
                node.send_events()

    def _watch_sync(self, passed: float) -> None:
        """What happens without SYNC: the mechanism goes on by the wall clock, and drives that miss SYNC stop."""
        silent = 0.0 if self._last_sync is None else self._awake - self._last_sync
        never = self._last_sync is None
        missed = never or silent > self.settings.sync_timeout
        if missed and not never:
            for node in self.nodes:
                self._miss_sync(node)
        runs_on = self.settings.run_on_after
        runs_on = runs_on is not None and not never and silent > runs_on
        on_its_own = any(
            node.drive.machine.stopping or node.drive.homing or node.drive.free for node in self.nodes
        )
        if runs_on or (missed and (on_its_own or self._goes_on_without_sync())):
            for node in self.nodes:
                # With SYNC they count for themselves how long a setpoint has stayed away.
                node.miss_setpoints(passed)
            self._pass_time(passed)
            self._sample()
            for node in self.nodes:
                node.send_events()

    def _miss_sync(self, node: SimulatedNode) -> None:
        drive = node.drive
        homes = drive.image[slot.MODE_DISPLAY] == Mode.HOMING
        if drive.axis.sync_loss == "fault" and drive.machine.enabled and drive.follows_sync and not homes:
            drive.fail(_SYNC_LOST)
            node.send_events()

    def _goes_on_without_sync(self) -> bool:
        return any(
            node.drive.axis.sync_loss == "run-on" and node.drive.machine.enabled for node in self.nodes
        )
