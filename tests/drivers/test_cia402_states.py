"""Compared with the standard's tables, written out here bit by bit and by transition number."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.cia402 import TRANSITIONS, Command, State, Transition, command_of, state_of
from drivers.simulated.cia402_machine import Cia402Machine

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


def walk(machine: Cia402Machine, *words: int) -> list[int]:
    made = []
    for word in words:
        before = machine.state
        machine.take_controlword(word)
        if machine.state is not before:
            assert machine.last_transition is not None
            made.append(int(machine.last_transition))
    return made


@pytest.fixture
def machine():
    started = Cia402Machine()
    assert started.state is State.NOT_READY_TO_SWITCH_ON
    started.start()
    return started


def test_a_drive_starts_by_itself_into_switch_on_disabled(machine):
    assert machine.state is State.SWITCH_ON_DISABLED
    assert machine.last_transition is Transition.INITIALISED


def test_the_usual_way_up_and_every_way_down(machine):
    assert walk(machine, 0x06, 0x07, 0x0F) == [2, 3, 4]
    assert walk(machine, 0x07, 0x06, 0x00) == [5, 6, 7]
    assert walk(machine, 0x06, 0x07, 0x0F, 0x06) == [2, 3, 4, 8]
    assert walk(machine, 0x07, 0x0F, 0x00) == [3, 4, 9]
    assert walk(machine, 0x06, 0x07, 0x02) == [2, 3, 10]
    assert walk(machine, 0x06, 0x07, 0x0F, 0x02, 0x00) == [2, 3, 4, 11, 12]


def test_enable_operation_from_ready_goes_through_switched_on(machine):
    assert walk(machine, 0x06, 0x0F) == [2, 4]
    assert machine.state is State.OPERATION_ENABLED


def test_enabling_again_while_enabled_changes_nothing(machine):
    walk(machine, 0x06, 0x07, 0x0F)
    assert walk(machine, 0x0F, 0x1F, 0x0F) == []


def test_a_quick_stop_ends_switched_off_or_holds_as_the_option_says(machine):
    walk(machine, 0x06, 0x07, 0x0F, 0x02)
    assert walk(machine, 0x0F) == []  # transition 16 only where the option holds
    machine.stopped()
    assert machine.state is State.SWITCH_ON_DISABLED
    machine.quick_stop_option = 6
    walk(machine, 0x06, 0x07, 0x0F, 0x02)
    machine.stopped()
    assert machine.state is State.QUICK_STOP_ACTIVE
    assert walk(machine, 0x0F) == [16]


@pytest.mark.parametrize("words", [(), (0x06,), (0x06, 0x07), (0x06, 0x07, 0x0F), (0x06, 0x07, 0x0F, 0x02)])
def test_a_fault_is_reached_from_every_state_and_left_by_a_rising_edge_only(machine, words):
    walk(machine, *words)
    powered = machine.powered
    machine.fail()
    if powered:
        assert machine.state is State.FAULT_REACTION_ACTIVE
        assert walk(machine, 0x80, 0x06, 0x00) == []
        machine.stopped()
    assert machine.state is State.FAULT
    assert machine.last_transition is Transition.FAULT
    assert walk(machine, 0x06, 0x07, 0x0F, 0x00) == []
    assert walk(machine, 0x80) == [15]
    machine.fail()
    assert walk(machine, 0x80) == []  # bit 7 is still set: no edge
    assert walk(machine, 0x00, 0x80) == [15]


def test_a_drive_that_shall_switch_off_on_faults_does_so_at_once(machine):
    walk(machine, 0x06, 0x07, 0x0F)
    machine.fault_reaction_option = 0
    machine.fail()
    assert machine.state is State.FAULT


def test_transitions_have_the_standard_s_numbers():
    """CiA 402-2, figure of the state machine."""
    names = (
        "START INITIALISED SHUTDOWN_FROM_DISABLED SWITCH_ON ENABLE_OPERATION DISABLE_OPERATION SHUTDOWN_FROM_SWITCHED_ON"
        " DISABLE_VOLTAGE_FROM_READY SHUTDOWN_FROM_ENABLED DISABLE_VOLTAGE_FROM_ENABLED DISABLE_VOLTAGE_FROM_SWITCHED_ON"
        " QUICK_STOP DISABLE_VOLTAGE_FROM_QUICK_STOP FAULT_REACTION FAULT FAULT_RESET ENABLE_OPERATION_FROM_QUICK_STOP"
    )
    assert [(one.name, one.value) for one in Transition] == [(n, k) for k, n in enumerate(names.split())]
