"""The simulated drive's state machine, walked by controlwords and compared with the standard's transition numbers."""

import pytest

from drivers.cia402 import State, Transition
from drivers.simulated.cia402_machine import Cia402Machine


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
