"""The inside of a simulated drive: encoder, modes of operation, servo, amplifier, supervision.

Nothing here knows of CAN. Values come and go through the process image; `node.py` moves them to and from PDOs
and SDOs, `rig.py` lets time pass.
"""

import math
import random

from drivers import cia402
from drivers.cia402 import Command, Mode, State
from drivers.simulated import process_image as slot
from drivers.simulated.cia402_machine import POWERED, Cia402Machine
from drivers.simulated.compensation import Compensation
from drivers.simulated.error_register import error_register
from drivers.simulated.faults import ENCODER_STANDS, SHOWN_STANDS, Faults
from drivers.simulated.servo import Servo
from drivers.simulated.settings import SimulatedAxis

SUPPORTED_MODES = (
    Mode.HOMING,
    Mode.INTERPOLATED_POSITION,
    Mode.CYCLIC_SYNCHRONOUS_POSITION,
    Mode.CYCLIC_SYNCHRONOUS_VELOCITY,
    Mode.CYCLIC_SYNCHRONOUS_TORQUE,
)
_POSITION_MODES = (Mode.INTERPOLATED_POSITION, Mode.CYCLIC_SYNCHRONOUS_POSITION)
_MODES_WITH_HALT = (Mode.INTERPOLATED_POSITION, Mode.HOMING)
"""the others among modes 6 to 10 have no halt (CiA 402-2: bit 8 is reserved there)"""
_ON_LOSS = {2: Command.DISABLE_VOLTAGE, 3: Command.QUICK_STOP}
_FOLLOWING_ERROR_CODE = 0x8611
# A stopping axis is at rest when it has been this slow for this long; an encoder shows one count per servo period at least.
_AT_REST = 0.05  # rad/s of the motor
_AT_REST_COUNTS = 1.5  # per servo period
_AT_REST_TIME = 0.03  # s
_BRAKE_SETTLES = 0.2  # s


class SimulatedDrive:
    """One axis.

    axis   : its settings
    faults : what goes wrong on purpose
    seed   : of current noise
    """

    def __init__(self, axis: SimulatedAxis, faults: Faults, seed: int):
        self.axis = axis
        self.faults = faults
        self.random = random.Random(seed)
        self.image = [0] * slot.SLOTS
        self.machine = Cia402Machine()
        self.servo = Servo(axis)
        self.compensation = Compensation(axis.compensation, axis.counts_per_turn)
        self.counts_per_radian = axis.counts_per_radian
        self.position_offset = axis.position_offset
        self.rated_current = axis.rated_current
        self.max_torque = round(axis.current_limit * 1000)  # per mille, 0x6072
        self.following_window = round(axis.following_error * axis.counts_per_turn)
        self.following_time = axis.following_error_time
        self.quick_stop_deceleration = axis.quick_stop_deceleration * axis.counts_per_radian
        self.software_limits: tuple[int, int] | None = None
        self.homing_method = 35
        self.homing_speed = 0.2 * axis.counts_per_turn  # counts/s
        self.home_offset = 0
        self.current = 0.0  # A, reference of the amplifier
        self.follows_sync = False  # whether SYNC has come since the drive was enabled
        self._demand = 0.0  # counts
        self._demand_velocity = 0.0  # counts/s
        self._from = 0.0
        self._to = 0.0
        self._slope = 0.0  # counts/s² or counts/s, of the interpolated target
        self._slope_before = 0.0  # the same, of the cycle before
        self._period = 1.0  # s, from setpoint to setpoint
        self._following_for = 0.0  # s
        self._rests_for = 0.0  # s
        self._following_error_shown = False
        self._homing_active = False
        self._told_to_home = False
        self._halted = False
        self._homed = False  # until power is lost
        self._index_pulse = 0
        self._hold: float | None = None  # counts, where the closed brake holds
        self._slow = _AT_REST * self.counts_per_radian  # counts/s; slower than that, the axis is at rest
        self._settles_for = 0.0  # s that the closed brake takes to hold
        self._was_powered = False
        self._off_for = 0.0  # s without power since the axis had it
        self._withheld = 0  # looks at a changed statusword that were shown the one before
        self._flipped_at: int | None = None  # counts, where the encoder's sign changed
        self._stood_at: int | None = None  # counts, where the encoder came to stand

    # ---- between the bus and the axis ----

    def start(self) -> None:
        """Power on: the state machine starts, everything commanded is forgotten."""
        self.machine = Cia402Machine()
        self.machine.start()
        for position in range(slot.SLOTS):
            if position not in (slot.POSITION, slot.TEMPERATURE):
                self.image[position] = 0
        self._homed = False
        self._homing_active = self._told_to_home = self._halted = False
        self._engage_brake()
        if not self._was_powered:
            # Until it first has power, something supports the axis.
            self._hold, self._settles_for = float(self.image[slot.POSITION]), 0.0
        self.update_statusword()

    def take_controlword(self) -> None:
        """Act on the controlword in the image."""
        if self.faults.disobeys:
            return
        controlword = self.image[slot.CONTROLWORD]
        before = self.machine.state
        self.machine.take_controlword(controlword)
        if (after := self.machine.state) is not before:
            self._entered(before, after)
        if self.image[slot.MODE_DISPLAY] == Mode.HOMING and after is State.OPERATION_ENABLED:
            start = bool(controlword & cia402.START_HOMING)
            if start and not self._told_to_home:
                self._homed = False
                self._begin_homing()
            elif not start:
                self._homing_active = False
            self._told_to_home = start
        halt = bool(controlword & cia402.HALT)
        if halt and not self._halted:
            self._demand_velocity = self.servo.velocity
        self._halted = halt
        self.update_statusword()

    def take_mode(self) -> None:
        """Act on the mode in the image: taken over at once when it is supported."""
        mode = self.image[slot.MODE]
        if self.faults.keep_mode or mode == self.image[slot.MODE_DISPLAY]:
            return
        if mode == 0 or mode in SUPPORTED_MODES:
            self.image[slot.MODE_DISPLAY] = mode
            self._homing_active = self._told_to_home = False
            if self.machine.enabled:
                self._start_following()
        self.update_statusword()

    def lose_master(self, option: int, code: int) -> None:
        """Act on the abort connection option code (0x6007): 1 a fault of this code, 2 no voltage, 3 quick stop."""
        if option == 1 and self.machine.powered:
            self.fail(code)
        elif option in _ON_LOSS and self.machine.enabled:
            self.machine.obey(_ON_LOSS[option])
            self._entered(State.OPERATION_ENABLED, self.machine.state)
            self.update_statusword()

    def fail(self, code: int) -> None:
        """A fault: error code and register are set, the fault reaction begins."""
        if self.machine.state in (State.FAULT, State.FAULT_REACTION_ACTIVE):
            return
        self.image[slot.ERROR_CODE] = code
        self.image[slot.ERROR_REGISTER] = error_register(code)
        before = self.machine.state
        self.machine.fail()
        self._entered(before, self.machine.state)
        self.update_statusword()

    def _entered(self, before: State, after: State) -> None:
        if after is State.OPERATION_ENABLED:
            self._was_powered = True
            if before is not State.QUICK_STOP_ACTIVE:
                self.servo.reset(self.current if self._hold is not None else 0.0)
            self._hold = None
            self.follows_sync = False
            self._start_following()
        elif after in (State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE):
            self._demand_velocity = self.servo.velocity
            self._rests_for = 0.0
        elif not self.machine.powered and before in POWERED:
            self._engage_brake()
        if before is State.FAULT and after is State.SWITCH_ON_DISABLED:
            self.image[slot.ERROR_CODE] = 0
            self.image[slot.ERROR_REGISTER] = 0
            self._following_error_shown = False

    def _start_following(self) -> None:
        """Start from where the axis is: no jump until a setpoint asks for one."""
        image = self.image
        position = image[slot.POSITION]
        image[slot.TARGET_POSITION] = image[slot.INTERPOLATION_DATA] = position
        image[slot.TARGET_VELOCITY] = 0
        image[slot.TARGET_TORQUE] = 0
        self._demand = float(position)
        self._demand_velocity = self.servo.velocity
        by_velocity = image[slot.MODE_DISPLAY] == Mode.CYCLIC_SYNCHRONOUS_VELOCITY
        self._from = self._to = self._demand_velocity if by_velocity else self._demand
        self._slope = self._slope_before = 0.0
        self._following_for = 0.0

    def _engage_brake(self) -> None:
        """Power is off. At rest a drive closes its brake first; in motion the axis coasts until it has closed."""
        self.image[slot.TORQUE_DEMAND] = self.image[slot.TORQUE] = self.image[slot.CURRENT] = 0
        self._off_for = 0.0
        if self._flipped_at is not None:
            self.servo.look_anew(-self.servo.velocity)
        resting = abs(self.servo.velocity) <= self._slow
        if self._stood_at is not None:
            # The brake closes by what the drive believes, and slips for as long as the axis turns in truth.
            self._off_for = self.axis.brake_delay if resting else 0.0
            self.servo.look_anew(2.0 * self._slow)
            resting = False
        self._hold = float(self.image[slot.POSITION]) if self.axis.brake and resting else None
        self._settles_for = 0.0 if resting else _BRAKE_SETTLES

    @property
    def free(self) -> bool:
        """Whether the axis has no power and may move all the same: it coasts, falls, or its brake is just closing."""
        return not self.machine.powered and (self._hold is None or self._settles_for > 0.0)

    def update_statusword(self) -> None:
        """Statusword from state, mode and supervision."""
        image = self.image
        machine = self.machine
        word = machine.state.value[1] | cia402.VOLTAGE_ENABLED | cia402.REMOTE
        if self.servo.limited and machine.powered:
            word |= cia402.INTERNAL_LIMIT_ACTIVE
        mode = image[slot.MODE_DISPLAY]
        if self._halted and machine.enabled and mode in _MODES_WITH_HALT:
            if self._demand_velocity == 0.0:
                word |= cia402.TARGET_REACHED
        elif mode == Mode.HOMING:
            if self._homed:
                word |= cia402.HOMING_ATTAINED | cia402.TARGET_REACHED
        else:
            if machine.enabled and mode:
                word |= cia402.FOLLOWS_COMMAND
            if self._following_error_shown:
                word |= cia402.FOLLOWING_ERROR
        if word != image[slot.STATUSWORD] and self._withheld < self.axis.oddities.shows_state_after:
            self._withheld += 1
            return
        self._withheld = 0
        image[slot.STATUSWORD] = word

    # ---- a SYNC ----

    def sample(self, angle: float, temperature: float) -> None:
        """Put what the drive measures at this instant into the image."""
        image = self.image
        position = self.encoder(angle)
        if self.faults.glitch:
            position += self.faults.glitch
            self.faults.glitch = 0
        if self.faults.feedback_stands == SHOWN_STANDS:
            position = image[slot.POSITION]
        image[slot.POSITION], image[slot.VELOCITY] = position, round(self.servo.velocity)
        image[slot.TEMPERATURE] = round(temperature * 10)

    def encoder(self, angle: float) -> int:
        """Counts that the encoder shows at a motor angle (rad)."""
        position = self._counts(angle)
        if self.faults.feedback_stands == ENCODER_STANDS:
            if self._stood_at is None:
                self._stood_at = position
            return self._stood_at
        if self.faults.feedback_flips:
            if self._flipped_at is None:
                self._flipped_at = position
            return 2 * self._flipped_at - position
        return position

    def _counts(self, angle: float) -> int:
        return math.floor(angle * self.counts_per_radian) + self.position_offset

    def activate_setpoints(self, period: float) -> None:
        """A SYNC makes the targets in the image effective; they are reached within `period` s."""
        if not self.machine.enabled:
            return
        self.follows_sync = True
        image = self.image
        mode = image[slot.MODE_DISPLAY]
        self._from = self._to
        if mode == Mode.CYCLIC_SYNCHRONOUS_POSITION:
            target = image[slot.TARGET_POSITION] + image[slot.POSITION_OFFSET]
        elif mode == Mode.INTERPOLATED_POSITION:
            if not image[slot.CONTROLWORD] & cia402.ENABLE_INTERPOLATION:
                target = image[slot.INTERPOLATION_DATA] = round(self._demand)
            else:
                target = image[slot.INTERPOLATION_DATA]
        elif mode == Mode.CYCLIC_SYNCHRONOUS_VELOCITY:
            target = image[slot.TARGET_VELOCITY] + image[slot.VELOCITY_OFFSET]
        else:
            return
        if self.software_limits is not None and mode in _POSITION_MODES:
            low, high = self.software_limits
            target = min(max(target, low), high)
        self._to = float(target)
        self._slope_before = self._slope
        self._slope = (self._to - self._from) / period
        self._period = period

    def servo_step(self, angle: float, since_sync: float, duration: float) -> float:
        """The amplifier's current (A) for the next servo period.

        angle      : rad, of the motor shaft now
        since_sync : s since the setpoints became effective
        duration   : s, servo period
        """
        servo = self.servo
        # The brake needs no encoder: without power what is observed is the axis itself.
        position = self.encoder(angle) if self.machine.powered else self._counts(angle)
        servo.observe(position, duration)
        limit = self.max_torque * 1e-3 * self.rated_current * self.faults.current_left
        machine = self.machine
        if machine.state is State.OPERATION_ENABLED:
            current = self._follow(position, since_sync, limit, duration)
        elif machine.stopping:
            current = self._brake(position, limit, duration)
        else:
            return self._without_power(position, duration)
        self.current = current
        per_mille = 1000.0 * current / self.rated_current
        image = self.image
        demand = round(per_mille)
        image[slot.TORQUE_DEMAND] = 0 if self.faults.current_stuck else demand
        noise = self.axis.current_noise
        if noise:
            current = demand * 1e-3 * self.rated_current + self.random.gauss(0.0, noise)
            image[slot.TORQUE] = image[slot.CURRENT] = round(1000.0 * current / self.rated_current)
            return current
        image[slot.TORQUE] = image[slot.CURRENT] = demand
        # The amplifier follows the reference that it shows: what is recorded is what acts.
        return demand * 1e-3 * self.rated_current

    def _follow(self, position: int, since_sync: float, limit: float, duration: float) -> float:
        image = self.image
        mode = image[slot.MODE_DISPLAY]
        servo = self.servo
        if mode == Mode.CYCLIC_SYNCHRONOUS_TORQUE:
            reference = (image[slot.TARGET_TORQUE] + image[slot.TORQUE_OFFSET]) * 1e-3 * self.rated_current
            current = min(max(reference, -limit), limit)
            servo.limited = current != reference
            servo.stand_by(current)
            self._demand = float(position)
            self._demand_velocity = servo.velocity
            return current
        if mode == Mode.CYCLIC_SYNCHRONOUS_VELOCITY:
            self._demand_velocity = self._from + self._slope * since_sync
            image[slot.VELOCITY_DEMAND] = round(self._demand_velocity)
            self._demand = float(position)
            return servo.follow_velocity(self._demand_velocity, limit, duration)
        if self._halted and mode in _MODES_WITH_HALT:
            return self._halt(position, limit, duration)
        if mode == Mode.HOMING and self._homing_active:
            return self._search_index(position, limit, duration)
        if self.faults.run_away:
            # Whatever it is told, it goes on with the speed that it is commanded by the fault.
            self._demand += self.faults.run_away * duration
            return servo.follow_velocity(float(self.faults.run_away), limit, duration)
        self._demand = demand = self._from + self._slope * since_sync
        # The feed-forward goes over from slope to slope within the cycle. A step at each SYNC would make the
        # current a sawtooth in step with the sampling, and what is recorded at SYNC would not be its mean.
        share = min(1.0, since_sync / self._period)
        self._demand_velocity = self._slope_before + (self._slope - self._slope_before) * share
        image[slot.POSITION_DEMAND], image[slot.FOLLOWING_ERROR] = round(demand), round(demand - position)
        self._supervise(demand - position, duration)
        added = image[slot.TORQUE_OFFSET] * 1e-3 * self.rated_current
        added += self.compensation.current(self._demand_velocity, position)
        return servo.follow_position(demand, self._demand_velocity, position, limit, duration, added)

    def _halt(self, position: int, limit: float, duration: float) -> float:
        """Controlword bit 8: the axis stops along the ramp and holds, enabled, until the bit goes."""
        self._slow_down(duration)
        self._demand = self._from = self._to = float(position)
        self._slope = self._slope_before = 0.0
        self.image[slot.INTERPOLATION_DATA] = position
        return self.servo.follow_velocity(self._demand_velocity, limit, duration)

    def _slow_down(self, duration: float) -> None:
        """Let the velocity demand fall along the ramp for `duration` s."""
        velocity, change = self._demand_velocity, self.quick_stop_deceleration * duration
        self._demand_velocity = velocity - math.copysign(min(change, abs(velocity)), velocity)

    def _supervise(self, error: float, duration: float) -> None:
        """Following error, objects 0x6065 and 0x6066."""
        self._following_for = self._following_for + duration if abs(error) > self.following_window else 0.0
        if self._following_for > self.following_time:
            self._following_error_shown = True
            self.fail(_FOLLOWING_ERROR_CODE)

    def _brake(self, position: int, limit: float, duration: float) -> float:
        """Quick stop and fault reaction: the velocity falls along the ramp, then the drive holds."""
        self._slow_down(duration)
        current = self.servo.follow_velocity(self._demand_velocity, limit, duration)
        self._demand = float(position)
        self._slow = max(_AT_REST * self.counts_per_radian, _AT_REST_COUNTS / duration)
        if self._demand_velocity or abs(self.servo.velocity) > self._slow:
            self._rests_for = 0.0
            return current
        self._rests_for += duration
        before = self.machine.state
        if self._rests_for >= _AT_REST_TIME:
            self.machine.stopped()
        if self.machine.state is not before:
            self._entered(before, self.machine.state)
        return current

    def _without_power(self, position: int, duration: float) -> float:
        """The brake of an axis without power, as a current that the drive does not report.

        It is open for a while, slips like dry friction while the axis turns, and holds once it stands.
        """
        self._off_for += duration
        if self._hold is None and (not self.axis.brake or self._off_for < self.axis.brake_delay):
            self.current = 0.0
            return 0.0
        limit = self.axis.brake_torque * self.rated_current
        if self._hold is None:
            if abs(self.servo.velocity) > self._slow:
                self.current = self.servo.follow_velocity(0.0, limit, duration)
                return self.current
            self._hold = float(position)
        self._settles_for -= duration
        self.current = self.servo.follow_position(self._hold, 0.0, position, limit, duration)
        return self.current

    # ---- homing ----

    @property
    def homing(self) -> bool:
        """Whether the drive is moving to find its home."""
        return self._homing_active

    def _begin_homing(self) -> None:
        """Methods 35 and 37: here is home. 33 and 34: go to the next index pulse, backwards or forwards."""
        if self.homing_method in (33, 34):
            self._homing_active = True
            self._index_pulse = self._turn(self.image[slot.POSITION])
            return
        self._set_home()

    def _turn(self, position: int) -> int:
        return (position - self.position_offset) // self.axis.counts_per_turn

    def _search_index(self, position: int, limit: float, duration: float) -> float:
        speed = self.homing_speed if self.homing_method == 34 else -self.homing_speed
        if self._turn(position) != self._index_pulse:
            turn = max(self._turn(position), self._index_pulse)
            index_position = turn * self.axis.counts_per_turn + self.position_offset
            self.position_offset += self.home_offset - index_position
            self._homing_active = False
            self._homed = True
            self._demand = self._from = self._to = float(position + self.home_offset - index_position)
            self._slope = self._slope_before = 0.0
            self.servo.shift(self.home_offset - index_position)
            self.update_statusword()
            speed = 0.0
        return self.servo.follow_velocity(speed, limit, duration)

    def _set_home(self) -> None:
        shift = self.home_offset - self.image[slot.POSITION]
        self.position_offset += shift
        self.image[slot.POSITION] += shift
        self.servo.shift(shift)
        self._start_following()
        self._homed = True
