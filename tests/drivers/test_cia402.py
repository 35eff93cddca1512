"""Compared with the standard's tables, written out here bit by bit and by transition number."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers import cia402
from drivers.cia402 import TRANSITIONS, Command, State, Transition, command_of, state_of

# IEC 61800-7-201, statusword: bits 6, 5, 3, 2, 1, 0; x does not matter.
STATUSWORD_TABLE = {
    State.NOT_READY_TO_SWITCH_ON: "0x 0000",
    State.SWITCH_ON_DISABLED: "1x 0000",
    State.READY_TO_SWITCH_ON: "01 0001",
    State.SWITCHED_ON: "01 0011",
    State.OPERATION_ENABLED: "01 0111",
    State.QUICK_STOP_ACTIVE: "00 0111",
    State.FAULT_REACTION_ACTIVE: "0x 1111",
    State.FAULT: "0x 1000",
}

# IEC 61800-7-201, controlword: bits 7, 3, 2, 1, 0.
CONTROLWORD_TABLE = {
    Command.SHUTDOWN: "0 x110",
    Command.SWITCH_ON: "0 0111",
    Command.ENABLE_OPERATION: "0 1111",
    Command.DISABLE_VOLTAGE: "0 xx0x",
    Command.QUICK_STOP: "0 x01x",
}

# The standard's figure of the state machine: number -> from, to, command.
FIGURE = {
    2: (State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON, Command.SHUTDOWN),
    3: (State.READY_TO_SWITCH_ON, State.SWITCHED_ON, Command.SWITCH_ON),
    4: (State.SWITCHED_ON, State.OPERATION_ENABLED, Command.ENABLE_OPERATION),
    5: (State.OPERATION_ENABLED, State.SWITCHED_ON, Command.SWITCH_ON),  # disable operation: same bits
    6: (State.SWITCHED_ON, State.READY_TO_SWITCH_ON, Command.SHUTDOWN),
    8: (State.OPERATION_ENABLED, State.READY_TO_SWITCH_ON, Command.SHUTDOWN),
    9: (State.OPERATION_ENABLED, State.SWITCH_ON_DISABLED, Command.DISABLE_VOLTAGE),
    11: (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, Command.QUICK_STOP),
    12: (State.QUICK_STOP_ACTIVE, State.SWITCH_ON_DISABLED, Command.DISABLE_VOLTAGE),
    15: (State.FAULT, State.SWITCH_ON_DISABLED, Command.FAULT_RESET),
    16: (State.QUICK_STOP_ACTIVE, State.OPERATION_ENABLED, Command.ENABLE_OPERATION),
}
BY_TWO_COMMANDS = {
    7: (State.READY_TO_SWITCH_ON, State.SWITCH_ON_DISABLED, {Command.QUICK_STOP, Command.DISABLE_VOLTAGE}),
    10: (State.SWITCHED_ON, State.SWITCH_ON_DISABLED, {Command.QUICK_STOP, Command.DISABLE_VOLTAGE}),
}


def matches(word: int, bits: tuple[int, ...], pattern: str) -> bool:
    symbols = pattern.replace(" ", "")
    return all(
        symbol == "x" or word >> bit & 1 == int(symbol) for bit, symbol in zip(bits, symbols, strict=True)
    )


@given(st.integers(0, 0xFFFF))
def test_every_statusword_shows_the_state_of_the_standard_s_table(word):
    expected = [
        state for state, pattern in STATUSWORD_TABLE.items() if matches(word, (6, 5, 3, 2, 1, 0), pattern)
    ]
    if expected:
        assert [state_of(word)] == expected
    else:
        with pytest.raises(ValueError, match="shows no state"):
            state_of(word)


@given(st.integers(0, 0xFFFF))
def test_every_controlword_asks_what_the_standard_s_table_says(word):
    if word & 0x80:
        assert command_of(word, previous=0) is Command.FAULT_RESET
        return
    expected = [
        command for command, pattern in CONTROLWORD_TABLE.items() if matches(word, (7, 3, 2, 1, 0), pattern)
    ]
    assert [command_of(word)] == expected


def test_the_transitions_are_those_of_the_standard_s_figure():
    expected = {(start, command): (number, end) for number, (start, end, command) in FIGURE.items()}
    for number, (start, end, commands) in BY_TWO_COMMANDS.items():
        expected |= {(start, command): (number, end) for command in commands}
    assert {key: (int(number), end) for key, (number, end) in TRANSITIONS.items()} == expected


def test_transitions_have_the_standard_s_numbers():
    """CiA 402-2, figure of the state machine."""
    names = (
        "START INITIALISED SHUTDOWN_FROM_DISABLED SWITCH_ON ENABLE_OPERATION DISABLE_OPERATION SHUTDOWN_FROM_SWITCHED_ON"
        " DISABLE_VOLTAGE_FROM_READY SHUTDOWN_FROM_ENABLED DISABLE_VOLTAGE_FROM_ENABLED DISABLE_VOLTAGE_FROM_SWITCHED_ON"
        " QUICK_STOP DISABLE_VOLTAGE_FROM_QUICK_STOP FAULT_REACTION FAULT FAULT_RESET ENABLE_OPERATION_FROM_QUICK_STOP"
    )
    assert [(one.name, one.value) for one in Transition] == [(n, k) for k, n in enumerate(names.split())]


# IEC 61800-7-201 and -301, bits beside the state: of the statusword, and of the controlword.
BITS = {
    "VOLTAGE_ENABLED": 4,
    "WARNING": 7,
    "REMOTE": 9,
    "TARGET_REACHED": 10,
    "INTERNAL_LIMIT_ACTIVE": 11,
    "FOLLOWS_COMMAND": 12,
    "HOMING_ATTAINED": 12,
    "FOLLOWING_ERROR": 13,
    "HOMING_ERROR": 13,
    "START_HOMING": 4,
    "ENABLE_INTERPOLATION": 4,
    "HALT": 8,
}


@pytest.mark.parametrize(("name", "bit"), BITS.items())
def test_bits_beside_the_state_stand_where_the_standard_has_them(name, bit):
    assert getattr(cia402, name) == 1 << bit
