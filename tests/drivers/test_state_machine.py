"""The master's walk through CiA 402 on a drive that answers from a table: each step, and each way to stay behind."""

from types import SimpleNamespace

import pytest

from drivers.cia402 import Command, Mode, State
from drivers.errors import DriveError
from drivers.simulated.cia402_machine import Cia402Machine
from drivers.state_machine import StateMachine, Timeouts

SHORT = Timeouts(transition=0.03, mode=0.03, quick_stop=0.03, homing=0.03, poll=0.001)
POWER, REMOTE = 1 << 4, 1 << 9


class Drive:
    """Objects of a drive with a state machine behind 0x6040 and 0x6041; what is stuck stays."""

    def __init__(self) -> None:
        self.machine = Cia402Machine()
        self.machine.start()
        self.bits = POWER | REMOTE
        self.objects = {0x6061: 0, 0x603F: 0, 0x1001: 0, 0x605A: 2, 0x606C: 0, 0x6502: 0x3FF}
        self.written: list[tuple[int, int]] = []
        self.follows_modes = True
        self.obeys = True

    def read(self, index: int, subindex: int, kind: str, what: str = "") -> int:
        if index == 0x6041:
            return self.machine.state.value[1] | self.bits
        if index not in self.objects:
            raise DriveError(7, what, index=index, received="no such object")
        return self.objects[index]

    def write(self, index: int, subindex: int, kind: str, value: int, what: str = "") -> None:
        self.written.append((index, value))
        if index == 0x6040 and self.obeys:
            self.machine.take_controlword(value)
        if index == 0x6060 and self.follows_modes:
            self.objects[0x6061] = value

    write_verified = write

    def controlwords(self) -> list[int]:
        return [value for index, value in self.written if index == 0x6040]


@pytest.fixture
def drive() -> Drive:
    return Drive()


@pytest.fixture
def walk(drive) -> StateMachine:
    return StateMachine(7, drive, SimpleNamespace(emergencies=[]), SHORT)


def test_enabling_walks_the_standard_s_way_and_does_nothing_where_it_has_been(walk, drive):
    walk.enable()
    assert drive.controlwords() == [0x06, 0x07, 0x0F]
    assert walk.state() is State.OPERATION_ENABLED
    walk.enable()
    assert len(drive.written) == 3


def test_a_drive_in_fault_is_not_enabled_and_says_why(walk, drive):
    drive.objects |= {0x603F: 0x4310, 0x1001: 0x08}
    drive.machine.fail()
    with pytest.raises(
        DriveError, match=r"the drive is in FAULT: .*hot.*error register: .*temperature"
    ) as error:
        walk.enable()
    assert (error.value.node, error.value.index) == (7, 0x6041)
    assert drive.written == []


@pytest.mark.parametrize(
    ("lacking", "words"),
    [(POWER, "no voltage at the power stage"), (REMOTE, "does not take commands from the bus")],
)
def test_a_drive_that_stays_behind_says_in_which_state_and_what_lacks(walk, drive, lacking, words):
    drive.obeys, drive.bits = False, (POWER | REMOTE) & ~lacking
    with pytest.raises(DriveError, match=words) as error:
        walk.enable()
    assert "the drive is in SWITCH ON DISABLED (0x" in error.value.received
    assert error.value.expected == f"{State.READY_TO_SWITCH_ON.words} within 0.03 s"
    assert sum(word in error.value.received for word in ("no voltage", "does not take commands")) == 1


def test_disabling_takes_the_power_and_leaves_a_fault_alone(walk, drive):
    walk.enable()
    walk.disable()
    assert walk.state() is State.SWITCH_ON_DISABLED
    count = len(drive.written)
    walk.disable()
    drive.machine.fail()
    walk.disable()
    assert len(drive.written) == count


def test_a_quick_stop_ends_switched_off_once_the_axis_rests(walk, drive):
    walk.quick_stop()
    assert drive.written == []  # nothing to stop
    walk.enable()
    drive.machine.take_controlword = lambda word: (
        Cia402Machine.take_controlword(drive.machine, word),
        drive.machine.stopped(),
    )
    walk.quick_stop()
    assert drive.controlwords()[-1] == Command.QUICK_STOP.value
    assert walk.state() is State.SWITCH_ON_DISABLED


def test_an_axis_that_does_not_come_to_rest_is_an_error(walk, drive):
    walk.enable()
    with pytest.raises(DriveError, match="the drive is in QUICK STOP ACTIVE"):
        walk.quick_stop()


@pytest.mark.parametrize(("option", "velocity", "fails"), [(5, 0, False), (6, 0, False), (5, -3, True)])
def test_a_drive_that_holds_is_at_rest_when_its_velocity_is(walk, drive, option, velocity, fails):
    drive.objects |= {0x605A: option, 0x606C: velocity}
    drive.machine.quick_stop_option = option
    walk.enable()
    if fails:
        with pytest.raises(DriveError, match="-3 came") as error:
            walk.quick_stop()
        assert error.value.index == 0x606C
    else:
        walk.quick_stop()
        assert walk.state() is State.QUICK_STOP_ACTIVE


def test_a_mode_is_asked_for_and_seen(walk, drive):
    walk.set_mode(Mode.CYCLIC_SYNCHRONOUS_POSITION)
    assert walk.mode() == 8
    drive.follows_modes = False
    with pytest.raises(DriveError, match="the drive stays in mode 8"):
        walk.set_mode(Mode.CYCLIC_SYNCHRONOUS_TORQUE)


def test_a_mode_that_the_drive_has_not_is_not_asked_for(walk, drive):
    drive.objects[0x6502] = 1 << (Mode.CYCLIC_SYNCHRONOUS_POSITION - 1)
    walk.set_mode(Mode.CYCLIC_SYNCHRONOUS_POSITION)
    count = len(drive.written)
    with pytest.raises(DriveError, match=r"bit 9; 0x00000080 came: the drive does not support this mode"):
        walk.set_mode(Mode.CYCLIC_SYNCHRONOUS_TORQUE)
    assert len(drive.written) == count
    del drive.objects[0x6502]  # optional: what it does not say is tried
    walk.set_mode(Mode.CYCLIC_SYNCHRONOUS_TORQUE)


def test_a_fault_is_reset_by_a_rising_edge_and_the_bit_taken_back(walk, drive):
    walk.reset_fault()
    assert drive.written == []
    drive.machine.fail()
    walk.reset_fault()
    assert drive.controlwords() == [0x00, 0x80, 0x00]
    assert walk.state() is State.SWITCH_ON_DISABLED


def test_a_fault_that_stays_is_an_error_and_the_bit_taken_back_all_the_same(walk, drive):
    drive.machine.fail()
    drive.obeys = False
    with pytest.raises(DriveError, match="the drive is in FAULT"):
        walk.reset_fault()
    assert drive.controlwords()[-1] == 0x00


HOMED, FAILED = 1 << 12 | 1 << 10, 1 << 13


def test_homing_is_started_by_bit_4_and_ends_when_it_is_attained_at_rest(walk, drive):
    drive.bits |= HOMED
    walk.home(method=35)
    assert (0x6098, 35) in drive.written
    assert drive.controlwords()[-3:] == [0x0F, 0x1F, 0x0F]
    assert walk.mode() == Mode.HOMING


@pytest.mark.parametrize("bits", [FAILED, 1 << 12, 1 << 10, 0, HOMED | FAILED])
def test_homing_that_is_not_attained_at_rest_in_time_is_an_error(walk, drive, bits):
    drive.bits |= bits
    with pytest.raises(DriveError, match=r"homing attained within 0\.03 s"):
        walk.home()
    assert not any(index == 0x6098 for index, _ in drive.written)


@pytest.mark.parametrize(("asked", "started"), [(0, False), (1, False), (2, True)])
def test_a_homing_that_is_stopped_is_not_begun_or_ends(walk, drive, asked, started):
    questions = iter(range(1000))
    with pytest.raises(DriveError, match="it was stopped"):
        walk.home(stopped=lambda: next(questions) >= asked)
    assert (0x1F in drive.controlwords()) is started


def test_what_is_wrong_is_said_from_code_register_and_the_last_message(walk, drive):
    assert walk.error_in_words() == "the drive reports no error"
    walk.watch.emergencies.append(SimpleNamespace(is_reset=False, code=0x8611))
    assert walk.error_in_words().startswith("last EMCY ")
    walk.watch.emergencies.append(SimpleNamespace(is_reset=True, code=0))
    assert walk.error_in_words() == "the drive reports no error"
    del drive.objects[0x603F], drive.objects[0x1001]
    assert (
        walk.error_in_words()
        == "the error code 0x603F cannot be read; the error register 0x1001 cannot be read"
    )
