"""A CANopen slave: canopen's LocalNode and what that one lacks.

canopen gives the object dictionary from an EDS and the SDO server. Added here: SYNC, synchronous and
event-driven TPDOs, RPDOs that reach the object dictionary, mappings that can be changed over SDO, NMT that
gates SDO and PDOs, boot-up after a reset, heartbeat with the state as it is, EMCY, the heartbeat consumer.
"""

import struct
from collections.abc import Callable, Collection

import canopen
from canopen.objectdictionary import ODArray, ODVariable, datatypes
from canopen.sdo.exceptions import SdoAbortedError

from drivers.object_dictionary import load_object_dictionary
from drivers.simulated import abort_codes
from drivers.simulated import process_image as slot
from drivers.simulated.faults import Faults
from drivers.simulated.guarded_node import GuardedNode
from drivers.simulated.late_boot import boot_after
from drivers.simulated.oddities import PDOS
from drivers.simulated.pdo import PDO_OFF, Pdo
from drivers.simulated.process_image import SLOT_OF_OBJECT, bits_of
from drivers.simulated.rating_objects import rating_objects, tuning_objects
from drivers.simulated.settings import SimulatedAxis
from drivers.simulated.simulated_drive import SUPPORTED_MODES, SimulatedDrive

DICTIONARY = "simulated.eds"
_INITIALISING, _STOPPED, _OPERATIONAL, _PRE_OPERATIONAL = 0, 4, 5, 127
_NMT_STATE_OF_COMMAND = {1: _OPERATIONAL, 2: _STOPPED, 128: _PRE_OPERATIONAL}
_FAULT_COMMAND = 0x2010
_RPDO_TIMEOUT = 0x8250


class SimulatedNode(canopen.LocalNode):
    """One drive as it appears on the bus.

    axis : settings of the drive
    seed : of its random sequences
    send : puts a frame on the bus
    """

    def __init__(self, axis: SimulatedAxis, seed: int, send: Callable[[int, bytes], None]):
        super().__init__(axis.node, load_object_dictionary(DICTIONARY, axis.node))
        self.node = axis.node
        # canopen's own heartbeat needs a bus that sends periodically by itself.
        self._write_callbacks.clear()  # pyright: ignore[reportUnknownMemberType]  untyped in canopen
        self.axis = axis
        self.send = send
        self.faults = Faults(axis.faults, seed)
        self.drive = SimulatedDrive(axis, self.faults, seed)
        self.nmt_state = _INITIALISING
        self.cycle = -1
        self.heartbeat_period = 0.0  # s
        self.master_heartbeat: tuple[int, float] | None = None  # node, s
        self.guarding = GuardedNode(0x700 + self.node, self._state_to_guard, send)
        self.guarding.toggles = axis.oddities.toggles
        self.communication_cycle = 0.0  # s, 0x1006
        self._interpolation = [1, -3]
        self._tpdos = [Pdo() for _ in range(PDOS)]
        self._rpdos = [Pdo() for _ in range(PDOS)]
        self._rpdo_of_id: dict[int, Pdo] = {}
        self._late: list[tuple[int, bytes]] = []
        self._emergency_shown = 0
        self._load_drive_objects()
        self._load_pdos()

    # ---- network management ----

    def boot(self) -> None:
        """Power on, or NMT reset: boot-up, then PRE-OPERATIONAL."""
        self.data_store.clear()
        self._load_drive_objects()
        self.drive.start()
        self.restart_communication()

    def restart_communication(self) -> None:
        """NMT reset communication: the communication objects are as in the EDS again."""
        for index in [index for index in self.data_store if index < 0x2000]:
            del self.data_store[index]
        self.heartbeat_period = 0.0
        self.master_heartbeat = None
        self.guarding.restart()
        self.communication_cycle = 0.0
        self._load_pdos()
        self._store_odd_values()
        self._late.clear()
        self._emergency_shown = 0
        self.nmt_state = _PRE_OPERATIONAL
        self.cycle = -1
        self.send(0x700 + self.node, b"\x00")

    def take_nmt(self, command: int, node: int) -> None:
        """An NMT command from the bus."""
        if self.faults.frozen or self.faults.deaf_to_nmt or node not in (0, self.node):
            return
        if command == 129:
            boot_after(self.axis.oddities.boots_after, self)
        elif command == 130:
            self.restart_communication()
        elif command in _NMT_STATE_OF_COMMAND:
            self.nmt_state = _NMT_STATE_OF_COMMAND[command]
            if self.nmt_state == _OPERATIONAL:
                self.cycle = -1
                for pdo in self._tpdos:
                    pdo.last_sent = None
                self.send_events()

    def send_heartbeat(self) -> None:
        """One heartbeat, unless a fault forbids it."""
        if not (self.faults.frozen or self.faults.heartbeat_stopped):
            self.send(0x700 + self.node, bytes((self.nmt_state,)))

    def _state_to_guard(self) -> int | None:
        """What a remote frame is answered by; nothing beside a heartbeat (CiA 301, 7.2.8.2.2.2)."""
        silent = self.faults.frozen or self.faults.heartbeat_stopped or self.heartbeat_period
        return None if silent else self.nmt_state

    @property
    def period(self) -> float:
        """s between two SYNCs: 0x1006 if written, otherwise 0x60C2."""
        if self.communication_cycle:
            return self.communication_cycle
        value, exponent = self._interpolation
        return value * 10.0**exponent

    # ---- frames ----

    def take_sdo(self, data: bytes) -> None:
        """An SDO request."""
        if not self.faults.frozen and self.nmt_state != _STOPPED:
            self.sdo.on_request(0x600 + self.node, data, 0.0)  # pyright: ignore[reportUnknownMemberType]  untyped in canopen
            self.send_events()

    @property
    def receive_ids(self) -> tuple[int, ...]:
        """CAN ids of the valid RPDOs."""
        return tuple(self._rpdo_of_id)

    def take_rpdo(self, can_id: int, data: bytes) -> None:
        """An RPDO; synchronous ones wait for the next SYNC."""
        pdo = self._rpdo_of_id.get(can_id)
        if pdo is None or self.nmt_state != _OPERATIONAL or self.faults.frozen or pdo.slots is None:
            return
        if len(data) < pdo.slots.struct.size:
            self.send_emergency(0x8210)
            return
        pdo.take(data)
        if not pdo.synchronous:
            pdo.slots.unpack(data, self.drive.image)
            self._act_on_image(pdo.slots.slots)
            self.send_events()

    def answer_sync(self, angle: float, temperature: float) -> None:
        """SYNC, first half: sample, and transmit the synchronous TPDOs."""
        faults = self.faults
        drive = self.drive
        drive.sample(angle, temperature)
        if self.nmt_state != _OPERATIONAL or faults.frozen:
            return
        self.cycle = cycle = self.cycle + 1
        faults.enter_cycle(cycle)
        if faults.waiting:
            machine = drive.machine
            speed = abs(drive.servo.velocity) / drive.counts_per_radian
            faults.enter_phase(machine.enabled, machine.stopping, speed)
        if faults.nmt_state is not None:
            self.nmt_state, faults.nmt_state = faults.nmt_state, None
        if faults.restarts:
            faults.restarts = False
            self.boot()
        if faults.frozen or self.nmt_state != _OPERATIONAL:
            return
        if faults.emergency is not None:
            code, faults.emergency = faults.emergency, None
            drive.fail(code)
        drive.update_statusword()
        if self._late:
            for can_id, data in self._late:
                self.send(can_id, data)
            self._late.clear()
        lost = faults.loses(cycle)
        late = faults.delays(cycle)
        for pdo in self._tpdos:
            if not pdo.valid or pdo.transmission_type > 240 or pdo.slots is None:
                continue
            if pdo.transmission_type > 1:
                pdo.syncs += 1
                if pdo.syncs < pdo.transmission_type:
                    continue
                pdo.syncs = 0
            data = pdo.slots.pack(drive.image)
            if lost:
                continue
            if late:
                self._late.append((pdo.can_id, data))
            else:
                self.send(pdo.can_id, data)
                if faults.doubles():
                    self.send(pdo.can_id, data)
        self._speak_for_others()
        if drive.image[slot.ERROR_CODE] != self._emergency_shown:
            self.show_error()

    def _speak_for_others(self) -> None:
        """Frames of a second master, as its faults say; this node's own link carries them."""
        faults = self.faults
        if faults.foreign_nmt is not None:
            command, faults.foreign_nmt = faults.foreign_nmt, None
            self.send(0, bytes((command, self.node)))
            self.take_nmt(command, self.node)

    def _hear_foreign_setpoint(self) -> None:
        """Somebody else's RPDO comes after ours in the same cycle, and takes effect."""
        counts = self.faults.foreign_setpoint
        if counts is None:
            return
        for can_id, pdo in self._rpdo_of_id.items():
            if pdo.slots is None or pdo.received is None:
                continue
            image = self.drive.image.copy()
            pdo.slots.unpack(pdo.received, image)
            target = (
                slot.TARGET_POSITION if slot.TARGET_POSITION in pdo.slots.slots else slot.INTERPOLATION_DATA
            )
            image[target] = self.drive.image[slot.POSITION] + counts
            image[slot.CONTROLWORD] = 0x1F
            pdo.received = pdo.slots.pack(image)
            self.send(can_id, pdo.received)

    def activate_setpoints(self, period: float) -> None:
        """SYNC, second half: what synchronous RPDOs brought becomes effective."""
        if self.faults.frozen:
            return
        self.miss_setpoints(period)
        self._hear_foreign_setpoint()
        for pdo in self._rpdos:
            if pdo.received is not None and pdo.slots is not None:
                data, pdo.received = pdo.received, None
                pdo.slots.unpack(data, self.drive.image)
                self._act_on_image(pdo.slots.slots)
        self.drive.activate_setpoints(period)

    def miss_setpoints(self, duration: float) -> None:
        """`duration` s have passed: an RPDO that stays away for its event time is an RPDO timeout, reacted to as 0x6007 says."""
        missed = [pdo.valid and pdo.missed_after(duration) for pdo in self._rpdos]
        if any(missed) and self.nmt_state == _OPERATIONAL and not self.faults.frozen:
            self.send_emergency(_RPDO_TIMEOUT)
            self.drive.lose_master(self._signed(0x6007, 0), _RPDO_TIMEOUT)
            self.send_events()

    def send_events(self) -> None:
        """Transmit event-driven TPDOs whose data changed, and EMCY when an error came or went."""
        if self.faults.frozen:
            return
        if self.drive.image[slot.ERROR_CODE] != self._emergency_shown:
            self.show_error()
        if self.nmt_state != _OPERATIONAL:
            return
        for pdo in self._tpdos:
            if pdo.valid and not pdo.synchronous and pdo.slots is not None:
                data = pdo.slots.pack(self.drive.image)
                if data != pdo.last_sent:
                    pdo.last_sent = data
                    self.send(pdo.can_id, data)

    def show_error(self) -> None:
        """EMCY with the drive's present error code; code 0 says that it has gone."""
        code = self.drive.image[slot.ERROR_CODE]
        self._emergency_shown = code
        self.send_emergency(code)

    def send_emergency(self, code: int) -> None:
        """One EMCY frame."""
        if self.nmt_state in (_OPERATIONAL, _PRE_OPERATIONAL):
            register = self.drive.image[slot.ERROR_REGISTER]
            self.send(0x80 + self.node, struct.pack("<HB5x", code, register))

    def _act_on_image(self, slots: Collection[int]) -> None:
        if slot.MODE in slots:
            self.drive.take_mode()
        if slot.CONTROLWORD in slots:
            self.drive.take_controlword()

    # ---- the object dictionary over SDO ----

    def get_data(self, index: int, subindex: int, check_readable: bool = False) -> bytes:
        """Bytes of an object; those of the process image come from there."""
        if check_readable and self.axis.oddities.lacks(index, subindex):
            raise SdoAbortedError(abort_codes.NO_OBJECT)
        slot_and_format = SLOT_OF_OBJECT.get((index, subindex))
        if slot_and_format is None:
            return super().get_data(index, subindex, check_readable)
        variable = self._find_object(index, subindex)
        if check_readable and not variable.readable:
            raise SdoAbortedError(abort_codes.WRITE_ONLY)
        self.drive.update_statusword()
        return struct.pack("<" + slot_and_format[1], self.drive.image[slot_and_format[0]])

    def set_data(self, index: int, subindex: int, data: bytes, check_writable: bool = False) -> None:
        """Write an object and act on it, once it is stored."""
        if check_writable:
            self._refuse(index, subindex, bytes(data))
        super().set_data(index, subindex, data, check_writable)
        slot_and_format = SLOT_OF_OBJECT.get((index, subindex))
        if slot_and_format is not None:
            self.drive.image[slot_and_format[0]] = struct.unpack("<" + slot_and_format[1], data)[0]
            self._act_on_image({slot_and_format[0]})
        elif check_writable:
            self._written(index, subindex)

    def _find_object(self, index: int, subindex: int) -> ODVariable:
        entry = self.object_dictionary.get(index)  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
        if isinstance(entry, ODArray) and subindex not in entry.subindices:  # pyright: ignore[reportUnknownMemberType]
            raise SdoAbortedError(abort_codes.NO_SUBINDEX)  # canopen would make one up
        return super()._find_object(index, subindex)  # pyright: ignore[reportUnknownMemberType]  untyped in canopen

    def _refuse(self, index: int, subindex: int, data: bytes) -> None:
        """Raise SdoAbortedError for values that the drive does not take."""
        if index == 0x6060 and data and struct.unpack("<b", data[:1])[0] not in (0, *SUPPORTED_MODES):
            raise SdoAbortedError(abort_codes.VALUE_RANGE)
        if self.axis.oddities.lacks(index, subindex):
            raise SdoAbortedError(abort_codes.NO_OBJECT)
        if self.axis.oddities.refuses(index, subindex):
            raise SdoAbortedError(abort_codes.READ_ONLY)
        is_mapping = 0x1600 <= index < 0x1600 + PDOS or 0x1A00 <= index < 0x1A00 + PDOS
        if not is_mapping:
            return
        if self._number(index - 0x200, 1) & PDO_OFF == 0 and self.nmt_state == _OPERATIONAL:
            raise SdoAbortedError(abort_codes.NOT_IN_THIS_STATE)
        value = int.from_bytes(data, "little")
        if subindex and value:
            self._slot_of_mapping(value)
        elif not subindex:
            entries = [self._number(index, position) for position in range(1, value + 1)]
            if sum(entry & 0xFF for entry in entries) > 64:
                raise SdoAbortedError(abort_codes.PDO_TOO_LONG)

    def _slot_of_mapping(self, entry: int) -> tuple[int, str]:
        slot_and_format = SLOT_OF_OBJECT.get((entry >> 16, entry >> 8 & 0xFF))
        if slot_and_format is None or bits_of(slot_and_format[1]) != entry & 0xFF:
            raise SdoAbortedError(abort_codes.CANNOT_BE_MAPPED)
        return slot_and_format

    def _number(self, index: int, subindex: int, signed: bool = False) -> int:
        return int.from_bytes(super().get_data(index, subindex), "little", signed=signed)

    def _signed(self, index: int, subindex: int) -> int:
        return self._number(index, subindex, signed=True)

    def _written(self, index: int, subindex: int) -> None:
        """Act on what was stored outside the process image."""
        drive = self.drive
        if index == 0x1017:
            self.heartbeat_period = self._number(index, 0) * 1e-3
        elif index == 0x1016:
            node, period = self._number(index, 1) >> 16 & 0x7F, (self._number(index, 1) & 0xFFFF) * 1e-3
            self.master_heartbeat = (node, period) if period else None
        elif index == 0x100C:
            self.guarding.guard_time = self._number(index, 0) * 1e-3
        elif index == 0x100D:
            self.guarding.life_time_factor = self._number(index, 0)
        elif index == 0x1006:
            self.communication_cycle = self._number(index, 0) * 1e-6
        elif index == 0x60C2:
            self._interpolation = [self._number(index, 1), self._signed(index, 2)]
        elif 0x1400 <= index < 0x1400 + PDOS or 0x1600 <= index < 0x1600 + PDOS or 0x1800 <= index < 0x1B00:
            self._load_pdos()
        elif index == _FAULT_COMMAND:
            self.faults.command(subindex, self._signed(index, subindex))
            if self.faults.emergency is not None:
                code, self.faults.emergency = self.faults.emergency, None
                drive.fail(code)
        elif index in drive.compensation.raw:
            drive.compensation.raw[index][max(subindex, 1) - 1] = self._signed(index, subindex)
            drive.compensation.take()
        elif index in drive.servo.raw:
            drive.servo.raw[index] = self._number(index, 0)
            drive.servo.take_gains()
        elif index == 0x605A:
            drive.machine.quick_stop_option = self._signed(index, 0)
        elif index == 0x605E:
            drive.machine.fault_reaction_option = self._signed(index, 0)
        elif index in (0x6072, 0x6073):
            drive.max_torque = min(self._number(0x6072, 0), self._number(0x6073, 0))
        elif index == 0x6065:
            drive.following_window = self._number(index, 0)
        elif index == 0x6066:
            drive.following_time = self._number(index, 0) * 1e-3
        elif index == 0x6085:
            drive.quick_stop_deceleration = float(self._number(index, 0))
        elif index == 0x607D:
            low, high = self._signed(index, 1), self._signed(index, 2)
            drive.software_limits = (low, high) if low < high else None
        elif index == 0x607C:
            drive.home_offset = self._signed(index, 0)
        elif index == 0x6098:
            drive.homing_method = self._signed(index, 0)
        elif index == 0x6099:
            drive.homing_speed = float(self._number(0x6099, 1))

    def _load_drive_objects(self) -> None:
        """The drive's ratings into the object dictionary."""
        axis = self.axis
        gains, tables = self.drive.servo.raw, self.drive.compensation.raw
        for (index, subindex), value in (rating_objects(axis) | tuning_objects(gains, tables)).items():
            self._store(index, subindex, value)
        if axis.oddities.fixed_interpolation is not None:
            self._store(0x60C2, 1, axis.oddities.fixed_interpolation)
            self._store(0x60C2, 2, -3)
            self._interpolation = [axis.oddities.fixed_interpolation, -3]

    def _store_odd_values(self) -> None:
        """What objects of this drive hold that others have otherwise, or do not have."""
        for address, value in self.axis.oddities.holds.items():
            index, subindex = int(address[2:6], 16), int(address[7:] or "0", 16)
            if index not in self.object_dictionary:
                variable = ODVariable(address, index, 0)
                variable.data_type, variable.access_type = datatypes.UNSIGNED32, "ro"
                self.object_dictionary.add_object(variable)  # pyright: ignore[reportUnknownMemberType]  untyped in canopen
            self._store(index, subindex, value)
            self._written(index, subindex)

    def _load_pdos(self) -> None:
        """Compile mappings and communication parameters as they stand in the object dictionary."""
        self._rpdo_of_id = {}
        for index, subindex, value in self.axis.oddities.fixed_pdo_objects(self.node):
            self._store(index, subindex, value)
        for number in range(PDOS):
            self._load_pdo(self._tpdos[number], 0x1800 + number, 0x1A00 + number)
            if number >= self.axis.oddities.receive_pdos:
                continue
            self._load_pdo(self._rpdos[number], 0x1400 + number, 0x1600 + number)
            if self._rpdos[number].valid:
                self._rpdo_of_id[self._rpdos[number].can_id] = self._rpdos[number]
        self.on_pdos_changed()

    def _store(self, index: int, subindex: int, value: int) -> None:
        variable = self._find_object(index, subindex)
        super().set_data(index, subindex, variable.encode_raw(value))

    def on_pdos_changed(self) -> None:
        """Told when CAN ids of RPDOs may have changed; the rig replaces it."""

    def _load_pdo(self, pdo: Pdo, communication: int, mapping: int) -> None:
        entries = [self._number(mapping, position + 1) for position in range(self._number(mapping, 0))]
        slots = [self._slot_of_mapping(entry) for entry in entries]
        pdo.load(self._number(communication, 1), self._number(communication, 2), slots)
        pdo.event_time = self._number(communication, 5) * 1e-3
