"""CiA 402 (IEC 61800-7-201): states, commands, transitions by the standard's numbers, modes of operation."""

from enum import Enum, IntEnum

TORQUE_OFFSET = 0x60B2
"""per mille of the rated torque (0x6076), added to what the drive's own controllers ask for"""
TARGET_TORQUE = 0x6071
"""per mille of the rated torque, in cyclic synchronous torque mode"""
ABORT_CONNECTION_OPTION = 0x6007
"""what a drive does when its master falls silent: 0 nothing, 1 fault, 2 no voltage, 3 quick stop"""
CONTROLWORD = 0x6040
STATUSWORD = 0x6041
QUICK_STOP_OPTION = 0x605A
ERROR_CODE = 0x603F
MODE_OF_OPERATION = 0x6060
MODE_OF_OPERATION_DISPLAY = 0x6061
SUPPORTED_DRIVE_MODES = 0x6502


class State(Enum):
    """States of the power drive system; value: (mask, pattern) of the statusword 0x6041."""

    NOT_READY_TO_SWITCH_ON = (0x4F, 0x00)
    SWITCH_ON_DISABLED = (0x4F, 0x40)
    READY_TO_SWITCH_ON = (0x6F, 0x21)
    SWITCHED_ON = (0x6F, 0x23)
    OPERATION_ENABLED = (0x6F, 0x27)
    QUICK_STOP_ACTIVE = (0x6F, 0x07)
    FAULT_REACTION_ACTIVE = (0x4F, 0x0F)
    FAULT = (0x4F, 0x08)

    @property
    def words(self) -> str:
        """The name as the standard writes it."""
        return self.name.replace("_", " ")


class Command(IntEnum):
    """Device control commands; value: the controlword 0x6040 (bits 0-3 and 7)."""

    DISABLE_VOLTAGE = 0x0000
    QUICK_STOP = 0x0002
    SHUTDOWN = 0x0006
    SWITCH_ON = 0x0007
    ENABLE_OPERATION = 0x000F
    FAULT_RESET = 0x0080


class Mode(IntEnum):
    """Modes of operation, object 0x6060."""

    INTERPOLATED_POSITION = 7
    HOMING = 6
    CYCLIC_SYNCHRONOUS_POSITION = 8
    CYCLIC_SYNCHRONOUS_VELOCITY = 9
    CYCLIC_SYNCHRONOUS_TORQUE = 10

    @property
    def words(self) -> str:
        """The name as the standard writes it."""
        return self.name.replace("_", " ").lower()


class Transition(IntEnum):
    """Transitions between states, by the standard's numbers; 0, 1, 13 and 14 the drive makes by itself."""

    START = 0
    INITIALISED = 1
    SHUTDOWN_FROM_DISABLED = 2
    SWITCH_ON = 3
    ENABLE_OPERATION = 4
    DISABLE_OPERATION = 5
    SHUTDOWN_FROM_SWITCHED_ON = 6
    DISABLE_VOLTAGE_FROM_READY = 7
    SHUTDOWN_FROM_ENABLED = 8
    DISABLE_VOLTAGE_FROM_ENABLED = 9
    DISABLE_VOLTAGE_FROM_SWITCHED_ON = 10
    QUICK_STOP = 11
    DISABLE_VOLTAGE_FROM_QUICK_STOP = 12
    FAULT_REACTION = 13
    FAULT = 14
    FAULT_RESET = 15
    ENABLE_OPERATION_FROM_QUICK_STOP = 16


# (state, what the controlword asks) -> (transition, next state)
TRANSITIONS: dict[tuple[State, Command], tuple[Transition, State]] = {
    (State.SWITCH_ON_DISABLED, Command.SHUTDOWN): (
        Transition.SHUTDOWN_FROM_DISABLED,
        State.READY_TO_SWITCH_ON,
    ),
    (State.READY_TO_SWITCH_ON, Command.SWITCH_ON): (Transition.SWITCH_ON, State.SWITCHED_ON),
    (State.SWITCHED_ON, Command.ENABLE_OPERATION): (Transition.ENABLE_OPERATION, State.OPERATION_ENABLED),
    # "Disable operation" is the bit pattern of "switch on".
    (State.OPERATION_ENABLED, Command.SWITCH_ON): (
        Transition.DISABLE_OPERATION,
        State.SWITCHED_ON,
    ),
    (State.SWITCHED_ON, Command.SHUTDOWN): (
        Transition.SHUTDOWN_FROM_SWITCHED_ON,
        State.READY_TO_SWITCH_ON,
    ),
    (State.READY_TO_SWITCH_ON, Command.DISABLE_VOLTAGE): (
        Transition.DISABLE_VOLTAGE_FROM_READY,
        State.SWITCH_ON_DISABLED,
    ),
    (State.READY_TO_SWITCH_ON, Command.QUICK_STOP): (
        Transition.DISABLE_VOLTAGE_FROM_READY,
        State.SWITCH_ON_DISABLED,
    ),
    (State.OPERATION_ENABLED, Command.SHUTDOWN): (
        Transition.SHUTDOWN_FROM_ENABLED,
        State.READY_TO_SWITCH_ON,
    ),
    (State.OPERATION_ENABLED, Command.DISABLE_VOLTAGE): (
        Transition.DISABLE_VOLTAGE_FROM_ENABLED,
        State.SWITCH_ON_DISABLED,
    ),
    (State.SWITCHED_ON, Command.DISABLE_VOLTAGE): (
        Transition.DISABLE_VOLTAGE_FROM_SWITCHED_ON,
        State.SWITCH_ON_DISABLED,
    ),
    (State.SWITCHED_ON, Command.QUICK_STOP): (
        Transition.DISABLE_VOLTAGE_FROM_SWITCHED_ON,
        State.SWITCH_ON_DISABLED,
    ),
    (State.OPERATION_ENABLED, Command.QUICK_STOP): (Transition.QUICK_STOP, State.QUICK_STOP_ACTIVE),
    (State.QUICK_STOP_ACTIVE, Command.DISABLE_VOLTAGE): (
        Transition.DISABLE_VOLTAGE_FROM_QUICK_STOP,
        State.SWITCH_ON_DISABLED,
    ),
    (State.QUICK_STOP_ACTIVE, Command.ENABLE_OPERATION): (
        Transition.ENABLE_OPERATION_FROM_QUICK_STOP,
        State.OPERATION_ENABLED,
    ),
    (State.FAULT, Command.FAULT_RESET): (Transition.FAULT_RESET, State.SWITCH_ON_DISABLED),
}

# The next command on the way from a state to OPERATION ENABLED.
TOWARDS_OPERATION_ENABLED: dict[State, tuple[Command, State]] = {
    State.SWITCH_ON_DISABLED: (Command.SHUTDOWN, State.READY_TO_SWITCH_ON),
    State.READY_TO_SWITCH_ON: (Command.SWITCH_ON, State.SWITCHED_ON),
    State.SWITCHED_ON: (Command.ENABLE_OPERATION, State.OPERATION_ENABLED),
    State.QUICK_STOP_ACTIVE: (Command.ENABLE_OPERATION, State.OPERATION_ENABLED),
}

# Statusword bits beside the state.
VOLTAGE_ENABLED = 1 << 4
WARNING = 1 << 7
REMOTE = 1 << 9
TARGET_REACHED = 1 << 10
INTERNAL_LIMIT_ACTIVE = 1 << 11
# Bit 12 is mode specific: the drive follows the command value (modes 7-10), homing attained (mode 6).
FOLLOWS_COMMAND = 1 << 12
HOMING_ATTAINED = 1 << 12
# Bit 13: following error (7, 8, 9), homing error (6).
FOLLOWING_ERROR = 1 << 13
HOMING_ERROR = 1 << 13

# Controlword bits beside the command.
START_HOMING = 1 << 4
ENABLE_INTERPOLATION = 1 << 4
HALT = 1 << 8


def state_of(statusword: int) -> State:
    """The state that a statusword shows.

    Raises ValueError for a pattern that the standard does not define.
    """
    for state in State:
        mask, pattern = state.value
        if statusword & mask == pattern:
            return state
    raise ValueError(f"statusword 0x{statusword:04X} shows no state of CiA 402")


def command_of(controlword: int, previous: int = 0) -> Command | None:
    """What a controlword asks, None for a pattern without meaning.

    previous : the controlword before; a fault reset is a rising edge of bit 7
    """
    if controlword & 0x80 and not previous & 0x80:
        return Command.FAULT_RESET
    if not controlword & 0x02:
        return Command.DISABLE_VOLTAGE
    if not controlword & 0x04:
        return Command.QUICK_STOP
    return {0x6: Command.SHUTDOWN, 0x7: Command.SWITCH_ON, 0xF: Command.ENABLE_OPERATION}.get(
        controlword & 0x0F, Command.SHUTDOWN if not controlword & 0x01 else None
    )
