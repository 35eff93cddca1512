"""A drive on durand, a CANopen stack that is not ours: SDO, PDO, SYNC, NMT, EMCY and heartbeat are durand's.

Of CiA 402 durand knows nothing; the state machine below is written after the standard's table of transitions and shares
no line with `drivers.simulated`. The axis is ideal: at each SYNC it is where it was told to be.
"""

import threading

import durand
from durand.datatypes import DatatypeEnum as Type
from durand.node import MinimalNode
from durand.scheduler import AbstractScheduler

NOT_ENABLED, READY, SWITCHED_ON, ENABLED, QUICK_STOP, FAULT = 0x40, 0x21, 0x23, 0x27, 0x07, 0x08
VOLTAGE_ENABLED = 0x10


class TimerScheduler(AbstractScheduler):
    """durand's timers on threads, each ended by `close`."""

    def __init__(self):
        self._lock = threading.Lock()
        self._timers = set()
        self._closed = False

    def add(self, delay, callback, args=(), kwargs=None):
        timer = threading.Timer(delay, callback, args, kwargs)
        timer.daemon = True
        with self._lock:
            self._timers = {each for each in self._timers if each.is_alive()}
            if not self._closed:
                self._timers.add(timer)
                timer.start()
        return timer

    def cancel(self, entry):
        entry.cancel()

    @property
    def lock(self):
        return self._lock

    def close(self):
        with self._lock:
            self._closed = True
            running = [each for each in self._timers if each.is_alive()]
        for timer in running:
            timer.cancel()
            timer.join(2)


OBJECTS = {
    0x603F: (Type.UNSIGNED16, "ro", 0),
    0x6040: (Type.UNSIGNED16, "rw", 0),
    0x6041: (Type.UNSIGNED16, "ro", NOT_ENABLED),
    0x605A: (Type.INTEGER16, "rw", 2),
    0x6060: (Type.INTEGER8, "rw", 0),
    0x6061: (Type.INTEGER8, "ro", 0),
    0x6064: (Type.INTEGER32, "ro", 1000),
    0x606C: (Type.INTEGER32, "ro", 0),
    0x6074: (Type.INTEGER16, "ro", 0),
    0x6076: (Type.UNSIGNED32, "ro", 2500),
    0x607A: (Type.INTEGER32, "rw", 0),
    0x6502: (Type.UNSIGNED32, "ro", 1 << 7),
}


class DurandDrive:
    """One axis.

    bus : a bus of python-can that this drive has for itself
    """

    def __init__(self, bus, node_id):
        self.scheduler = TimerScheduler()
        durand.set_scheduler(self.scheduler)
        self.network = durand.CANBusNetwork(bus)
        self.bus = bus
        self.node = MinimalNode(self.network, node_id)
        self.objects = self.node.object_dictionary
        for index, (kind, access, value) in OBJECTS.items():
            self.objects[index] = durand.Variable(kind, access, value)
        cycle = durand.Record()
        cycle[1] = durand.Variable(Type.UNSIGNED8, "rw", 1)
        cycle[2] = durand.Variable(Type.INTEGER8, "rw", -3)
        self.objects[0x60C2] = cycle
        self.objects[0x1006] = durand.Variable(Type.UNSIGNED32, "rw", 0)
        self.objects.write(0x1000, 0, 0x0002_0192)
        self.objects.write(0x1008, 0, b"drive on durand, with a name of several segments")
        self.objects.write(0x1018, 1, 0x1234)
        self.objects.write(0x1018, 2, 0x77)
        self.controlword = 0
        self.syncs = 0
        self.objects.update_callbacks[(0x6040, 0)].add(self._control)
        self.objects.update_callbacks[(0x6060, 0)].add(lambda mode: self.objects.write(0x6061, 0, mode))
        self.node.sync.callbacks.add(self._sync)
        self.node.nmt.state_callbacks.add(self._network_state)

    def fail(self, code, register):
        """Go to FAULT and say so by EMCY."""
        self.objects.write(0x603F, 0, code)
        self._show(FAULT)
        self.node.emcy.set(code, register)

    def close(self):
        self.scheduler.close()
        self.network.stop()
        self.bus.shutdown()

    @property
    def _state(self):
        return self.objects.read(0x6041, 0) & ~VOLTAGE_ENABLED

    def _show(self, state):
        self.objects.write(0x6041, 0, state | VOLTAGE_ENABLED)

    def _network_state(self, state):
        if state == durand.node.StateEnum.INITIALISATION:
            self.objects.write(0x6041, 0, NOT_ENABLED)
            self.objects.write(0x1017, 0, 0)

    def _control(self, word):
        """Device control commands of CiA 402, table 30; the numbers of transitions beside each."""
        before, self.controlword = self.controlword, word
        state = self._state
        if state == FAULT:
            if word & ~before & 0x80:  # 15
                self.objects.write(0x603F, 0, 0)
                self.node.emcy.set(0, 0)
                self._show(NOT_ENABLED)
        elif (
            word & 0x06 != 0x06
        ):  # 7, 9, 10, 12; after 11 the ideal axis rests at once, and by option 2 goes on by 12
            self._show(NOT_ENABLED)
        elif word & 0x07 == 0x06:  # 2, 6, 8
            self._show(READY)
        elif word & 0x0F == 0x07 and state in (READY, ENABLED):  # 3, 5
            self._show(SWITCHED_ON)
        elif word & 0x0F == 0x0F and state in (READY, SWITCHED_ON):  # 4, and 3 with it
            self._show(ENABLED)

    def _sync(self):
        self.syncs += 1
        if self._state == ENABLED and self.objects.read(0x6061, 0) == 8:
            target = self.objects.read(0x607A, 0)
            self.objects.write(0x6074, 0, max(-1000, min(1000, target - self.objects.read(0x6064, 0))))
            self.objects.write(0x6064, 0, target)
